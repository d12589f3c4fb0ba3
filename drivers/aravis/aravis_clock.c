/*
 * A two-sided reading of a GigE Vision device's clock: it is asked to latch its time, and did so
 * between our question and its acknowledge.
 */
#include <errno.h>

#include "base/clock.h"
#include "drivers/aravis/aravis_device.h"

/* GigE Vision bootstrap registers. */
enum {
	REGISTER_TIMESTAMP_CONTROL = 0x0944,
	REGISTER_TIMESTAMP_HIGH = 0x0948,
	REGISTER_TIMESTAMP_LOW = 0x094c,
	TIMESTAMP_LATCH = 2,
};

static int read_latched(ArvDevice *device, guint64 ticks_per_s, int64_t *device_ns)
{
	guint32 high = 0, low = 0;

	if (!arv_device_read_register(device, REGISTER_TIMESTAMP_HIGH, &high, NULL) ||
	    !arv_device_read_register(device, REGISTER_TIMESTAMP_LOW, &low, NULL))
		return -EIO;
	unsigned __int128 ticks = (guint64)high << 32 | low;

	if (!ticks)
		return -ENOTSUP;
	*device_ns = (int64_t)(ticks * NS_PER_S / ticks_per_s);
	return 0;
}

static int read_once(ArvDevice *device, guint64 ticks_per_s, struct device_clock *out)
{
	struct device_clock reading;
	int64_t asked_ns = clock_now_ns();

	if (!arv_device_write_register(device, REGISTER_TIMESTAMP_CONTROL, TIMESTAMP_LATCH, NULL))
		return -EIO;
	int64_t acknowledged_ns = clock_now_ns();
	int error = read_latched(device, ticks_per_s, &reading.device_ns);

	if (error)
		return error;
	reading.host_ns = asked_ns + (acknowledged_ns - asked_ns) / 2;
	reading.bound_ns = (acknowledged_ns - asked_ns) / 2 + NS_PER_US;
	*out = reading;
	return 0;
}

int aravis_read_clock(ArvCamera *device, int tries, struct device_clock *out)
{
	ArvDevice *registers = arv_camera_get_device(device);
	guint64 ticks_per_s = 0;
	bool found = false;

	if (arv_camera_is_gv_device(device))
		ticks_per_s =
			arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(registers), NULL);
	if (!ticks_per_s)
		return -ENOTSUP;
	for (int i = 0; i < tries; i++) {
		struct device_clock reading;
		int error = read_once(registers, ticks_per_s, &reading);

		if (error)
			return error;
		if (!found || reading.bound_ns < out->bound_ns)
			*out = reading;
		found = true;
	}
	return 0;
}
