/*
 * The mode of a camera: format and size of its stream; rate, exposure and gain within what its
 * controls allow.
 */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/libcamera/libcamera_device.h"

#define POOL_NS (250 * NS_PER_MS) /* a capture thread may stall this long */
#define POOL_MIN 6
#define POOL_MAX 32
#define ROW_BYTES_MAX (8 * 16384)

struct mode_setting {
	const struct libcamera_at *at;
	const struct camera_mode *wanted;
	struct diag *diag;
	struct libcamera_offers offers;
	char names[300]; /* of all formats, ours or not */
	struct libcamera_light light;
};

static void add_name(struct mode_setting *s, const char *name)
{
	size_t length = strlen(name), used = strlen(s->names);

	for (const char *at = s->names; (at = strstr(at, name)); at += length)
		if (at[length] == '\0' || at[length] == ',')
			return;
	if (used + length + 3 < sizeof(s->names))
		snprintf(s->names + used, sizeof(s->names) - used, "%s%s", used ? ", " : "", name);
}

static void add_offer(bool raw, const char *name, int width_px, int height_px, void *user)
{
	struct mode_setting *s = user;

	add_name(s, name);
	libcamera_format_add(&s->offers, raw, name, width_px, height_px);
}

static int refuse_format(const struct mode_setting *s)
{
	diag_add(s->diag,
		 "%s: pixel format: %s is wanted, the camera offers %s; grey comes from R8 to R16, "
		 "NV12 and YUYV, colour (role hd) from Bayer of 8 bits or packed, MJPEG, YUYV and "
		 "BGR888",
		 s->at->address, pixel_format_name(s->wanted->format),
		 *s->names ? s->names : "none at all");
	return -ENOTSUP;
}

static int refuse_size(const struct mode_setting *s, const struct libcamera_offer *chosen,
		       const struct libcamera_stream *given)
{
	char list[400] = "";

	for (int i = 0; i < s->offers.count; i++) {
		const struct libcamera_offer *offer = &s->offers.offers[i];
		size_t used = strlen(list);

		if (offer->format == chosen->format && offer->raw == chosen->raw)
			snprintf(list + used, sizeof(list) - used, "%s%dx%d", used ? ", " : "",
				 offer->width_px, offer->height_px);
	}
	diag_add(s->diag, "%s: size: %dx%d is wanted, the camera gives %dx%d; it has %s",
		 s->at->address, s->wanted->width_px, s->wanted->height_px, given->width_px,
		 given->height_px, *list ? list : "no other");
	return -EINVAL;
}

static uint32_t pool_size(int64_t period_ns)
{
	int64_t count = period_ns > 0 ? POOL_NS / period_ns + 2 : 0;

	return (uint32_t)(count < POOL_MIN ? POOL_MIN : count > POOL_MAX ? POOL_MAX : count);
}

/* Checked, because the capture thread believes it. */
static int check_stream(const struct mode_setting *s, const struct libcamera_format *format,
			const struct libcamera_stream *stream)
{
	size_t row_bytes = libcamera_packed_row_bytes(format, stream->width_px);
	size_t stride = (size_t)stream->stride_bytes;
	bool compressed = format->format == PIXEL_MJPEG;

	if (compressed ||
	    (stream->stride_bytes > 0 && stride >= row_bytes && stride <= ROW_BYTES_MAX &&
	     (format->format != PIXEL_GREY16 || format->packing || stride % 2 == 0)))
		return 0;
	diag_add(s->diag,
		 "%s: libcamera gives pictures of %dx%d with rows of %zu bytes, which cannot be: "
		 "another format or size",
		 s->at->address, stream->width_px, stream->height_px, stride);
	return -ENOTSUP;
}

static int set_stream(struct mode_setting *s, const struct libcamera_offer *offer,
		      struct libcamera_stream *stream)
{
	const struct camera_mode *wanted = s->wanted;
	int error;

	*stream = (struct libcamera_stream){.raw = offer->raw,
					    .width_px = wanted->width_px,
					    .height_px = wanted->height_px,
					    .buffer_count = pool_size(wanted->period_ns)};
	snprintf(stream->format, sizeof(stream->format), "%s", offer->format->name);
	error = libcamera_shim_configure(s->at->device, stream);
	if (error)
		return libcamera_fail(s->at, error, "format", s->diag);
	if (strcmp(stream->format, offer->format->name) != 0)
		return refuse_format(s);
	if ((wanted->width_px && stream->width_px != wanted->width_px) ||
	    (wanted->height_px && stream->height_px != wanted->height_px))
		return refuse_size(s, offer, stream);
	return check_stream(s, offer->format, stream);
}

static int choose_stream(struct mode_setting *s, struct libcamera_stream *stream,
			 const struct libcamera_format **format)
{
	const struct libcamera_offer *chosen;

	libcamera_shim_offers(s->at->device, add_offer, s);
	chosen = libcamera_format_choose(&s->offers, s->wanted);
	if (!chosen)
		return refuse_format(s);
	*format = chosen->format;
	return set_stream(s, chosen, stream);
}

/* A trigger's edges are the rate: the camera's own is the fastest, so that it swallows none. */
static int set_rate(struct mode_setting *s, struct camera_mode *mode)
{
	double wanted_us = (double)s->wanted->period_ns / NS_PER_US, least_us, most_us;

	if (!libcamera_shim_range(s->at->device, LIBCAMERA_PERIOD_US, &least_us, &most_us) ||
	    wanted_us <= 0 || least_us <= 0)
		return 0;
	if (wanted_us < least_us * 0.99) {
		diag_add(
			s->diag,
			"%s: frame rate: %.6g Hz is wanted, the camera gives %.6g Hz at this size: "
			"a lower rate_hz, or a smaller width and height",
			s->at->address, 1e6 / wanted_us, 1e6 / least_us);
		return -EINVAL;
	}
	wanted_us = fmax(least_us, fmin(wanted_us, most_us));
	mode->period_ns = llround(wanted_us * NS_PER_US);
	s->light.values[LIBCAMERA_PERIOD_US] = s->wanted->triggered ? least_us : wanted_us;
	return 0;
}

/* With the camera's own automatic switched off, and as near as it can. */
static int set_one(struct mode_setting *s, enum libcamera_setting setting, const char *key,
		   double *value)
{
	double low, high;

	if (!libcamera_shim_range(s->at->device, setting, &low, &high)) {
		diag_add(s->diag,
			 "%s: %s: libcamera cannot set it on this camera: take it out, or set the "
			 "sensor's own under controls",
			 s->at->address, key);
		return -ENOTSUP;
	}
	*value = fmax(low, fmin(*value, high));
	s->light.values[setting] = *value;
	return 0;
}

static int set_light(struct mode_setting *s, struct camera_mode *mode)
{
	double exposure_us = (double)s->wanted->exposure_ns / NS_PER_US;
	double gain = pow(10, s->wanted->gain_db / 20);
	int error = 0;

	if (s->wanted->exposure_ns > 0) {
		error = set_one(s, LIBCAMERA_EXPOSURE_US, "exposure_us", &exposure_us);
		mode->exposure_ns = llround(exposure_us * NS_PER_US);
	}
	if (!error && s->wanted->gain_db > 0) {
		error = set_one(s, LIBCAMERA_GAIN, "gain_db", &gain);
		mode->gain_db = 20 * log10(gain);
	}
	return error;
}

/* libcamera tells no shutter: the sensor's name does, or else the operator. */
static enum camera_shutter shutter_of(const struct mode_setting *s)
{
	enum camera_shutter known = libcamera_sensor_shutter(libcamera_shim_model(s->at->device));

	return known != SHUTTER_UNKNOWN ? known : s->wanted->shutter;
}

/* Of a rolling shutter whose rows the sensor did not tell: at worst they take the whole period. */
static int64_t row_time_ns(const struct mode_setting *s, const struct camera_mode *mode)
{
	int64_t readout_ns = s->wanted->readout_ns ? s->wanted->readout_ns : mode->period_ns;

	if (mode->shutter != SHUTTER_ROLLING)
		return 0;
	if (s->wanted->row_time_ns)
		return s->wanted->row_time_ns;
	if (mode->row_time_ns && !s->wanted->readout_ns)
		return mode->row_time_ns;
	if (!readout_ns)
		readout_ns = s->wanted->period_ns ? s->wanted->period_ns : NS_PER_S;
	return readout_ns > mode->height_px ? readout_ns / mode->height_px : 1;
}

int libcamera_configure_device(const struct libcamera_at *at, const struct camera_mode *wanted,
			       struct camera_mode *granted, struct libcamera_stream *stream,
			       const struct libcamera_format **format,
			       struct libcamera_light *light, struct diag *diag)
{
	struct mode_setting s = {.at = at, .wanted = wanted, .diag = diag};
	struct camera_mode mode = {.triggered = wanted->triggered,
				   .readout_ns = wanted->readout_ns};
	int error = choose_stream(&s, stream, format);

	mode.width_px = stream->width_px;
	mode.height_px = stream->height_px;
	if (!error)
		error = set_rate(&s, &mode);
	if (!error)
		error = set_light(&s, &mode);
	if (!error)
		error = libcamera_set_sensor(at, wanted, &mode, diag);
	if (error)
		return error;
	mode.format = (*format)->format;
	mode.bits = (*format)->bits;
	mode.shutter = shutter_of(&s);
	mode.row_time_ns = row_time_ns(&s, &mode);
	*light = s.light;
	*granted = mode;
	return 0;
}
