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
#include "drivers/aravis_device.h"

#define TRIGGER_LINE "Line0"
#define LOOPBACK_PACKET_BYTES 16000 /* no wire: larger packets cost fewer system calls */
#define REGISTER_GVCP_CAPABILITY 0x0934
#define CAPABILITY_PACKET_RESEND 0x4

struct device_setting {
	ArvCamera *device;
	const char *address;
	struct diag *diag;
	GError *error;
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

static int refuse_format(struct device_setting *s)
{
	char list[256] = "";
	guint count = 0;
	const char **names =
		arv_camera_dup_available_pixel_formats_as_strings(s->device, &count, NULL);

	for (guint i = 0; i < count && strlen(list) + strlen(names[i]) + 3 < sizeof(list); i++)
		snprintf(list + strlen(list), sizeof(list) - strlen(list), "%s%s", i ? ", " : "",
			 names[i]);
	g_free(names);
	diag_add(s->diag, "%s: pixel format: Mono8 is needed; the camera has %s", s->address,
		 *list ? list : "none that it names");
	return -ENOTSUP;
}

static int set_format(struct device_setting *s, enum pixel_format wanted)
{
	if (wanted != PIXEL_GREY8) {
		diag_add(s->diag, "%s: pixel format: this driver gives 8-bit grey (Mono8) only",
			 s->address);
		return -ENOTSUP;
	}
	if (arv_camera_get_pixel_format(s->device, NULL) == ARV_PIXEL_FORMAT_MONO_8)
		return 0;
	arv_camera_set_pixel_format(s->device, ARV_PIXEL_FORMAT_MONO_8, NULL);
	if (arv_camera_get_pixel_format(s->device, NULL) != ARV_PIXEL_FORMAT_MONO_8)
		return refuse_format(s);
	return 0;
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

/* Edge of Line0, or the camera's own clock. */
static int set_trigger(struct device_setting *s, const struct camera_mode *wanted)
{
	if (wanted->triggered) {
		if (!arv_camera_is_feature_available(s->device, "TriggerSource", NULL) ||
		    !arv_device_is_enumeration_entry_available(arv_camera_get_device(s->device),
							       "TriggerSource", TRIGGER_LINE,
							       NULL)) {
			diag_add(s->diag, "%s: trigger: the camera has no trigger input %s",
				 s->address, TRIGGER_LINE);
			return -ENOTSUP;
		}
		arv_camera_set_trigger(s->device, TRIGGER_LINE, &s->error);
		return failed(s, "trigger input " TRIGGER_LINE);
	}
	arv_camera_clear_triggers(s->device, &s->error);
	if (!s->error && wanted->period_ns > 0 && writable(s, "AcquisitionFrameRate"))
		arv_camera_set_frame_rate(s->device, (double)NS_PER_S / (double)wanted->period_ns,
					  &s->error);
	return failed(s, "frame rate");
}

static int set_light(struct device_setting *s, const struct camera_mode *wanted)
{
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
static int set_packet_size(struct device_setting *s)
{
	if (!arv_camera_is_gv_device(s->device))
		return 0;
	if (ntohl(aravis_ip(s->device).s_addr) >> 24 == IN_LOOPBACKNET) {
		arv_camera_gv_set_stream_options(s->device,
						 ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
		arv_camera_gv_set_packet_size_adjustment(s->device,
							 ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
		arv_camera_gv_set_packet_size(s->device, LOOPBACK_PACKET_BYTES, &s->error);
	} else {
		arv_camera_gv_auto_packet_size(s->device, &s->error);
	}
	return failed(s, "packet size");
}

static void read_mode(struct device_setting *s, const struct camera_mode *wanted,
		      struct camera_mode *granted)
{
	gint x, y;
	double rate_hz = 0;

	*granted = (struct camera_mode){.format = PIXEL_GREY8, .triggered = wanted->triggered};
	arv_camera_get_region(s->device, &x, &y, &granted->width_px, &granted->height_px,
			      &s->error);
	if (arv_camera_is_frame_rate_available(s->device, NULL))
		rate_hz = arv_camera_get_frame_rate(s->device, NULL);
	if (rate_hz > 0)
		granted->period_ns = llround((double)NS_PER_S / rate_hz);
	if (arv_camera_is_exposure_time_available(s->device, NULL))
		granted->exposure_ns =
			llround(arv_camera_get_exposure_time(s->device, NULL) * NS_PER_US);
	if (arv_camera_is_gain_available(s->device, NULL))
		granted->gain_db = arv_camera_get_gain(s->device, NULL);
}

int aravis_configure_device(ArvCamera *device, const char *address,
			    const struct camera_mode *wanted, struct camera_mode *granted,
			    struct diag *diag)
{
	struct device_setting s = {.device = device, .address = address, .diag = diag};
	struct camera_mode mode;
	int error;

	/* A receiver that died may have left it running. */
	arv_camera_stop_acquisition(device, NULL);
	error = set_format(&s, wanted->format);
	if (!error)
		error = set_size(&s, wanted);
	if (!error)
		error = set_trigger(&s, wanted);
	if (!error)
		error = set_light(&s, wanted);
	if (!error)
		error = set_packet_size(&s);
	if (error)
		return error;
	arv_camera_set_acquisition_mode(device, ARV_ACQUISITION_MODE_CONTINUOUS, NULL);
	read_mode(&s, wanted, &mode);
	error = failed(&s, "size");
	if (!error)
		*granted = mode;
	return error;
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
