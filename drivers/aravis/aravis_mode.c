/*
 * The mode of a device by its GenICam features: set what it has, read back what it does.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/aravis/aravis_device.h"

#define LOOPBACK_PACKET_BYTES 16000 /* no wire: larger packets cost fewer system calls */
#define REGISTER_GVCP_CAPABILITY 0x0934
#define CAPABILITY_PACKET_RESEND 0x4

/* Inputs that a trigger may be wired to: the first of these that a camera has. */
static const char *const trigger_lines[] = {"Line0", "Line1"};

struct device_setting {
	ArvCamera *device;
	const char *address;
	struct diag *diag;
	GError *error;
	bool rate_off; /* its own rate does not hold, so what it says of it is no limit */
	struct aravis_format format;
	enum camera_receive receive;
};

static int failed(struct device_setting *s, const char *doing)
{
	return s->error ? aravis_fail(&s->error, -EIO, s->address, doing, s->diag) : 0;
}

static bool writable(const struct device_setting *s, const char *feature)
{
	ArvDevice *device = arv_camera_get_device(s->device);

	return arv_device_is_feature_available(device, feature, NULL) &&
	       arv_device_get_feature_access_mode(device, feature) != ARV_GC_ACCESS_MODE_RO;
}

/* The whole sensor, or the size wanted around its middle. */
static int set_size(struct device_setting *s, const struct camera_mode *wanted)
{
	gint sensor_width = 0, sensor_height = 0;
	gint width, height;

	if (!wanted->width_px && !wanted->height_px)
		return 0;
	arv_camera_get_sensor_size(s->device, &sensor_width, &sensor_height, &s->error);
	if (s->error)
		return failed(s, "sensor size");
	width = wanted->width_px ? wanted->width_px : sensor_width;
	height = wanted->height_px ? wanted->height_px : sensor_height;
	if (width > sensor_width || height > sensor_height) {
		diag_add(s->diag, "%s: size: %dx%d is wanted, the sensor has %dx%d", s->address,
			 width, height, sensor_width, sensor_height);
		return -EINVAL;
	}
	if (writable(s, "Width") && writable(s, "Height"))
		arv_camera_set_region(s->device, (sensor_width - width) / 2 & ~7,
				      (sensor_height - height) / 2 & ~7, width, height, &s->error);
	return failed(s, "size");
}

/* Features that not every camera has, or lets be set. */
static void choose(const struct device_setting *s, const char *feature, const char *entry)
{
	ArvDevice *device = arv_camera_get_device(s->device);

	if (writable(s, feature) &&
	    arv_device_is_enumeration_entry_available(device, feature, entry, NULL))
		arv_device_set_string_feature_value(device, feature, entry, NULL);
}

static bool switch_on(const struct device_setting *s, const char *feature, bool on)
{
	if (!writable(s, feature))
		return false;
	arv_device_set_boolean_feature_value(arv_camera_get_device(s->device), feature, on, NULL);
	return true;
}

static const char *trigger_line(const struct device_setting *s)
{
	ArvDevice *device = arv_camera_get_device(s->device);

	for (size_t i = 0; i < sizeof(trigger_lines) / sizeof(trigger_lines[0]); i++)
		if (arv_device_is_feature_available(device, "TriggerSource", NULL) &&
		    arv_device_is_enumeration_entry_available(device, "TriggerSource",
							      trigger_lines[i], NULL))
			return trigger_lines[i];
	return NULL;
}

/* The rising edge of its input starts each exposure. A camera's own rate would only swallow edges:
 * it is switched off. */
static int wire_trigger(struct device_setting *s)
{
	const char *line = trigger_line(s);

	if (!line) {
		diag_add(s->diag, "%s: trigger: the camera has no trigger input %s or %s",
			 s->address, trigger_lines[0], trigger_lines[1]);
		return -ENOTSUP;
	}
	s->rate_off = switch_on(s, "AcquisitionFrameRateEnable", false);
	arv_camera_set_trigger(s->device, line, &s->error);
	if (!s->error && writable(s, "TriggerDelay"))
		arv_device_set_float_feature_value(arv_camera_get_device(s->device), "TriggerDelay",
						   0, NULL);
	return failed(s, "trigger input");
}

/* Edge of an input line, or the camera's own clock. */
static int set_trigger(struct device_setting *s, const struct camera_mode *wanted)
{
	if (wanted->triggered)
		return wire_trigger(s);
	arv_camera_clear_triggers(s->device, &s->error);
	switch_on(s, "AcquisitionFrameRateEnable", wanted->period_ns > 0);
	if (!s->error && wanted->period_ns > 0 && writable(s, "AcquisitionFrameRate"))
		arv_camera_set_frame_rate(s->device, (double)NS_PER_S / (double)wanted->period_ns,
					  &s->error);
	return failed(s, "frame rate");
}

static int set_light(struct device_setting *s, const struct camera_mode *wanted)
{
	choose(s, "ExposureMode", "Timed");
	if (wanted->exposure_ns > 0 &&
	    (writable(s, "ExposureTime") || writable(s, "ExposureTimeAbs"))) {
		arv_camera_set_exposure_time_auto(s->device, ARV_AUTO_OFF, NULL);
		arv_camera_set_exposure_time(s->device, (double)wanted->exposure_ns / NS_PER_US,
					     &s->error);
	}
	if (!s->error && wanted->gain_db != 0 && writable(s, "Gain")) {
		arv_camera_set_gain_auto(s->device, ARV_AUTO_OFF, NULL);
		arv_camera_set_gain(s->device, wanted->gain_db, &s->error);
	}
	return failed(s, "exposure and gain");
}

struct in_addr aravis_ip(ArvCamera *device)
{
	ArvGvDevice *gv = ARV_GV_DEVICE(arv_camera_get_device(device));
	GInetSocketAddress *at = G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(gv));
	struct in_addr ip;

	memcpy(&ip, g_inet_address_to_bytes(g_inet_socket_address_get_address(at)), sizeof(ip));
	return ip;
}

/* The largest packets that pass between camera and host: tried out where the camera has test
 * packets, known on loopback, else left as the camera has it. */
static int set_packets(struct device_setting *s, const struct camera_mode *wanted)
{
	if (!arv_camera_is_gv_device(s->device))
		return 0;
	s->receive = aravis_may_have_packets() ? wanted->receive : CAMERA_RECEIVE_SOCKET;
	arv_camera_gv_set_stream_options(s->device,
					 s->receive == CAMERA_RECEIVE_PACKETS
						 ? ARV_GV_STREAM_OPTION_NONE
						 : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
	if (ntohl(aravis_ip(s->device).s_addr) >> 24 == IN_LOOPBACKNET) {
		arv_camera_gv_set_packet_size_adjustment(s->device,
							 ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
		arv_camera_gv_set_packet_size(s->device, LOOPBACK_PACKET_BYTES, &s->error);
	} else {
		arv_camera_gv_auto_packet_size(s->device, &s->error);
	}
	return failed(s, "packet size");
}

/* 0: not known. */
static int64_t period_ns(const struct device_setting *s)
{
	ArvDevice *device = arv_camera_get_device(s->device);
	double rate_hz = 0;

	if (arv_device_is_feature_available(device, "ResultingFrameRate", NULL))
		rate_hz = arv_device_get_float_feature_value(device, "ResultingFrameRate", NULL);
	else if (!s->rate_off && arv_camera_is_frame_rate_available(s->device, NULL))
		rate_hz = arv_camera_get_frame_rate(s->device, NULL);
	return rate_hz > 0 ? llround((double)NS_PER_S / rate_hz) : 0;
}

/* The camera knows better than the config, where it tells. */
static enum camera_shutter shutter_of(const struct device_setting *s,
				      const struct camera_mode *wanted)
{
	ArvDevice *device = arv_camera_get_device(s->device);
	const char *name = NULL;

	if (arv_device_is_feature_available(device, "SensorShutterMode", NULL))
		name = arv_device_get_string_feature_value(device, "SensorShutterMode", NULL);
	return !name                          ? wanted->shutter
	       : strcmp(name, "Rolling") == 0 ? SHUTTER_ROLLING
					      : SHUTTER_GLOBAL;
}

/* Between rows of a rolling shutter; else 0. Cameras do not tell how long reading takes: the
 * operator may, else it is a whole period. */
static int64_t row_time_ns(const struct camera_mode *wanted, const struct camera_mode *granted)
{
	int64_t readout_ns = wanted->readout_ns ? wanted->readout_ns : granted->period_ns;

	if (granted->shutter != SHUTTER_ROLLING)
		return 0;
	if (wanted->row_time_ns)
		return wanted->row_time_ns;
	if (!readout_ns)
		readout_ns = NS_PER_S;
	return readout_ns > granted->height_px ? readout_ns / granted->height_px : 1;
}

static void read_mode(struct device_setting *s, const struct camera_mode *wanted,
		      struct camera_mode *granted)
{
	gint x, y;

	*granted = (struct camera_mode){.format = s->format.format,
					.bits = s->format.bits,
					.triggered = wanted->triggered,
					.receive = s->receive,
					.readout_ns = wanted->readout_ns,
					.period_ns = period_ns(s)};
	arv_camera_get_region(s->device, &x, &y, &granted->width_px, &granted->height_px,
			      &s->error);
	if (arv_camera_is_exposure_time_available(s->device, NULL))
		granted->exposure_ns =
			llround(arv_camera_get_exposure_time(s->device, NULL) * NS_PER_US);
	if (arv_camera_is_gain_available(s->device, NULL))
		granted->gain_db = arv_camera_get_gain(s->device, NULL);
	granted->shutter = shutter_of(s, wanted);
	granted->row_time_ns = row_time_ns(wanted, granted);
}

int aravis_configure_device(ArvCamera *device, const char *address,
			    const struct camera_mode *wanted, struct camera_mode *granted,
			    ArvPixelFormat *format, struct diag *diag)
{
	struct device_setting s = {.device = device, .address = address, .diag = diag};
	struct camera_mode mode;
	int error;

	/* A receiver that died may have left it running. */
	arv_camera_stop_acquisition(device, NULL);
	error = aravis_set_format(device, address, wanted, &s.format, diag);
	if (!error)
		error = set_size(&s, wanted);
	if (!error)
		error = set_trigger(&s, wanted);
	if (!error)
		error = set_light(&s, wanted);
	if (!error)
		error = set_packets(&s, wanted);
	if (error)
		return error;
	arv_camera_set_acquisition_mode(device, ARV_ACQUISITION_MODE_CONTINUOUS, NULL);
	read_mode(&s, wanted, &mode);
	error = failed(&s, "size");
	if (error)
		return error;
	*granted = mode;
	*format = s.format.code;
	return 0;
}

bool aravis_stamps_middle(ArvCamera *device)
{
	static const struct {
		const char *vendor, *model;
	} middle[] = {{"stage", "sim-gige"}};
	const char *vendor = arv_camera_get_vendor_name(device, NULL);
	const char *model = arv_camera_get_model_name(device, NULL);

	for (size_t i = 0; i < sizeof(middle) / sizeof(middle[0]); i++)
		if (vendor && model && strcmp(vendor, middle[i].vendor) == 0 &&
		    strcmp(model, middle[i].model) == 0)
			return true;
	return false;
}

bool aravis_resends(ArvCamera *device)
{
	guint32 capability = 0;

	return arv_camera_is_gv_device(device) &&
	       arv_device_read_register(arv_camera_get_device(device), REGISTER_GVCP_CAPABILITY,
					&capability, NULL) &&
	       (capability & CAPABILITY_PACKET_RESEND);
}
