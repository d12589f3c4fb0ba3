/*
 * The mode of a device: format, size and rate are asked for, and read back.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2_device.h"

#define FORMATS_MAX 128
#define SIZES_MAX 64
#define RATES_MAX 64
#define INTERVAL_UNITS_PER_S 10000000 /* 100 ns, as USB cameras count */

static const struct known {
	uint32_t fourcc;
	enum pixel_format format;
	int bits;
} known_formats[] = {
	{V4L2_PIX_FMT_GREY, PIXEL_GREY8, 0},       {V4L2_PIX_FMT_Y12, PIXEL_GREY16, 12},
	{V4L2_PIX_FMT_Y10, PIXEL_GREY16, 10},      {V4L2_PIX_FMT_Y14, PIXEL_GREY16, 14},
	{V4L2_PIX_FMT_Y16, PIXEL_GREY16, 16},      {V4L2_PIX_FMT_SRGGB8, PIXEL_BAYER_RG8, 0},
	{V4L2_PIX_FMT_SGRBG8, PIXEL_BAYER_GR8, 0}, {V4L2_PIX_FMT_SGBRG8, PIXEL_BAYER_GB8, 0},
	{V4L2_PIX_FMT_SBGGR8, PIXEL_BAYER_BG8, 0}, {V4L2_PIX_FMT_MJPEG, PIXEL_MJPEG, 0},
	{V4L2_PIX_FMT_YUYV, PIXEL_YUYV, 0},        {V4L2_PIX_FMT_RGB24, PIXEL_RGB8, 0},
};

#define KNOWN_COUNT (sizeof(known_formats) / sizeof(known_formats[0]))

/* What may stand in for a format that the caller leaves to the device, best first. */
static const enum pixel_format for_grey[] = {PIXEL_GREY8, PIXEL_GREY16, PIXEL_YUYV};
static const enum pixel_format for_colour[] = {PIXEL_BAYER_RG8, PIXEL_BAYER_GR8, PIXEL_BAYER_GB8,
					       PIXEL_BAYER_BG8, PIXEL_MJPEG,     PIXEL_YUYV,
					       PIXEL_RGB8,      PIXEL_GREY8};

struct mode_setting {
	const struct v4l2_device *device;
	const struct camera_mode *wanted;
	struct diag *diag;
	int offered_count;
	uint32_t offered[FORMATS_MAX];
	const struct known *chosen;
	bool takes_luma;
};

static int fail(const struct mode_setting *s, int error, const char *doing)
{
	return v4l2_fail(s->device, error, doing, s->diag);
}

static void read_offered(struct mode_setting *s)
{
	struct v4l2_fmtdesc about = {.type = s->device->type};

	while (s->offered_count < FORMATS_MAX &&
	       v4l2_ask(s->device->fd, VIDIOC_ENUM_FMT, &about) == 0) {
		s->offered[s->offered_count++] = about.pixelformat;
		about.index++;
	}
}

static bool is_offered(const struct mode_setting *s, uint32_t fourcc)
{
	for (int i = 0; i < s->offered_count; i++)
		if (s->offered[i] == fourcc)
			return true;
	return false;
}

static bool choose(struct mode_setting *s, enum pixel_format format)
{
	for (size_t k = 0; k < KNOWN_COUNT && !s->chosen; k++) {
		const struct known *known = &known_formats[k];

		if (known->format == format && is_offered(s, known->fourcc) &&
		    (!s->wanted->bits || known->format != PIXEL_GREY16 ||
		     known->bits == s->wanted->bits))
			s->chosen = known;
	}
	return s->chosen;
}

static int refuse_format(const struct mode_setting *s)
{
	char list[FORMATS_MAX * 6 + 1] = "";

	for (int i = 0; i < s->offered_count; i++) {
		size_t used = strlen(list);

		snprintf(list + used, sizeof(list) - used, "%s%.4s", i ? ", " : "",
			 (const char *)&s->offered[i]);
	}
	diag_add(s->diag,
		 "%s: pixel format: %s is wanted, the camera offers %s; grey comes from GREY, Y10 "
		 "to Y16 and YUYV, colour (role hd) from Bayer (RGGB, GRBG, GBRG, BA81), MJPG and "
		 "YUYV",
		 s->device->address, pixel_format_name(s->wanted->format),
		 *list ? list : "none that it names");
	return -ENOTSUP;
}

static int choose_format(struct mode_setting *s)
{
	enum pixel_format wanted = s->wanted->format;
	bool found = false;

	read_offered(s);
	if (wanted == PIXEL_GREY8)
		for (size_t i = 0; i < sizeof(for_grey) / sizeof(for_grey[0]) && !found; i++)
			found = choose(s, for_grey[i]);
	else if (wanted == PIXEL_BAYER_RG8)
		for (size_t i = 0; i < sizeof(for_colour) / sizeof(for_colour[0]) && !found; i++)
			found = choose(s, for_colour[i]);
	else
		found = choose(s, wanted);
	if (!found)
		return refuse_format(s);
	s->takes_luma = wanted == PIXEL_GREY8 && s->chosen->format == PIXEL_YUYV;
	return 0;
}

/* 0 where the device does not tell. */
static int64_t interval_ns(const struct v4l2_fract *interval)
{
	if (!interval->numerator || !interval->denominator)
		return 0;
	return (int64_t)((uint64_t)interval->numerator * NS_PER_S / interval->denominator);
}

/* Of frames of this size: as fast as is wanted, to a percent; also where the device does not tell.
 */
static bool keeps_rate(const struct mode_setting *s, const struct v4l2_frmsize_discrete *size)
{
	struct v4l2_frmivalenum rate = {
		.pixel_format = s->chosen->fourcc, .width = size->width, .height = size->height};
	int64_t enough_ns = s->wanted->period_ns + s->wanted->period_ns / 100;

	if (s->wanted->period_ns <= 0)
		return true;
	for (; rate.index < RATES_MAX &&
	       v4l2_ask(s->device->fd, VIDIOC_ENUM_FRAMEINTERVALS, &rate) == 0;
	     rate.index++)
		if (rate.type != V4L2_FRMIVAL_TYPE_DISCRETE)
			return interval_ns(&rate.stepwise.min) <= enough_ns;
		else if (interval_ns(&rate.discrete) <= enough_ns)
			return true;
	return rate.index == 0;
}

/* The largest of the sizes that the device lists, of those that keep the rate if any does; with
 * `list` all of them in words. */
static void read_sizes(const struct mode_setting *s, struct v4l2_frmsize_discrete *largest,
		       char *list, size_t list_bytes)
{
	struct v4l2_frmsizeenum size = {.pixel_format = s->chosen->fourcc};
	bool largest_keeps = false;

	for (; size.index < SIZES_MAX &&
	       v4l2_ask(s->device->fd, VIDIOC_ENUM_FRAMESIZES, &size) == 0 &&
	       size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
	     size.index++) {
		const struct v4l2_frmsize_discrete *d = &size.discrete;
		bool keeps = keeps_rate(s, d);
		bool larger =
			(uint64_t)d->width * d->height > (uint64_t)largest->width * largest->height;

		if ((keeps && !largest_keeps) || (keeps == largest_keeps && larger))
			*largest = *d;
		largest_keeps = largest_keeps || keeps;
		size_t used = list ? strlen(list) : 0;

		if (list)
			snprintf(list + used, list_bytes - used, "%s%ux%u", used ? ", " : "",
				 d->width, d->height);
	}
}

static int check_format(const struct mode_setting *s, const struct v4l2_pix_format *pix,
			uint32_t plane_count)
{
	const struct camera_mode *wanted = s->wanted;
	struct v4l2_frmsize_discrete largest = {0};
	char list[600] = "";

	if (pix->pixelformat != s->chosen->fourcc)
		return refuse_format(s);
	if (plane_count > 1) {
		diag_add(s->diag,
			 "%s: its pictures of %.4s lie in %u memory planes: another format, or a "
			 "camera of whole pictures",
			 s->device->address, (const char *)&pix->pixelformat, plane_count);
		return -ENOTSUP;
	}
	if (pix->field != V4L2_FIELD_NONE && pix->field != V4L2_FIELD_ANY) {
		diag_add(s->diag, "%s: interlaced pictures: a camera of whole pictures is needed",
			 s->device->address);
		return -ENOTSUP;
	}
	if ((!wanted->width_px || pix->width == (uint32_t)wanted->width_px) &&
	    (!wanted->height_px || pix->height == (uint32_t)wanted->height_px))
		return 0;
	read_sizes(s, &largest, list, sizeof(list));
	diag_add(s->diag, "%s: size: %dx%d is wanted, the camera gives %ux%u%s%s",
		 s->device->address, wanted->width_px, wanted->height_px, pix->width, pix->height,
		 *list ? "; it has " : "", list);
	return -EINVAL;
}

/* The size wanted, or else the largest listed, or else the one that is set. */
static int set_format(const struct mode_setting *s, struct v4l2_pix_format *out)
{
	struct v4l2_pix_format pix = {0};
	struct v4l2_frmsize_discrete largest = {0};
	uint32_t plane_count;
	int error = v4l2_ask_format(s->device, VIDIOC_G_FMT, &pix, &plane_count);

	if (error)
		return fail(s, error, "format");
	read_sizes(s, &largest, NULL, 0);
	if (largest.width) {
		pix.width = largest.width;
		pix.height = largest.height;
	}
	if (s->wanted->width_px)
		pix.width = (uint32_t)s->wanted->width_px;
	if (s->wanted->height_px)
		pix.height = (uint32_t)s->wanted->height_px;
	pix.pixelformat = s->chosen->fourcc;
	pix.field = V4L2_FIELD_NONE;
	pix.bytesperline = 0;
	error = v4l2_ask_format(s->device, VIDIOC_S_FMT, &pix, &plane_count);
	if (error)
		return fail(s, error, "format");
	error = check_format(s, &pix, plane_count);
	if (!error)
		*out = pix;
	return error;
}

static int set_rate(const struct mode_setting *s, int64_t *period_ns)
{
	struct v4l2_streamparm parm = {.type = s->device->type};
	struct v4l2_captureparm *capture = &parm.parm.capture;
	int error = v4l2_ask(s->device->fd, VIDIOC_G_PARM, &parm);

	*period_ns = 0;
	if (error == -ENOTTY || error == -EINVAL)
		return 0; /* it has no rate to tell */
	if (!error && s->wanted->period_ns > 0 && capture->capability & V4L2_CAP_TIMEPERFRAME) {
		capture->timeperframe = (struct v4l2_fract){
			(uint32_t)(s->wanted->period_ns / (NS_PER_S / INTERVAL_UNITS_PER_S)),
			INTERVAL_UNITS_PER_S};
		error = v4l2_ask(s->device->fd, VIDIOC_S_PARM, &parm);
	}
	if (error)
		return fail(s, error, "frame rate");
	*period_ns = interval_ns(&capture->timeperframe);
	return 0;
}

/* Checked, because the capture thread believes it. */
static int make_layout(const struct mode_setting *s, const struct v4l2_pix_format *pix,
		       struct v4l2_layout *layout)
{
	size_t row_bytes = pixel_row_bytes(s->chosen->format, (int)pix->width);
	size_t stride = pix->bytesperline ? pix->bytesperline : row_bytes;
	bool compressed = s->chosen->format == PIXEL_MJPEG;

	if (pix->width == 0 || pix->width > 16384 || pix->height == 0 || pix->height > 16384 ||
	    (!compressed && (stride < row_bytes || stride > 8 * 16384)) ||
	    (s->chosen->format == PIXEL_GREY16 && stride % 2)) {
		diag_add(s->diag,
			 "%s: the camera's driver gives pictures of %ux%u with rows of %zu bytes, "
			 "which cannot be: another format or size",
			 s->device->address, pix->width, pix->height, stride);
		return -ENOTSUP;
	}
	*layout = (struct v4l2_layout){
		.size_bytes = compressed ? 0 : stride * (pix->height - 1) + row_bytes,
		.stride_bytes = compressed ? 0 : (int)stride,
		.takes_luma = s->takes_luma,
	};
	return 0;
}

/* As the config says, else as the sensor's own timing does, else the readout spread over all rows.
 */
static int64_t row_time_ns(const struct v4l2_device *device, const struct camera_mode *wanted,
			   const struct v4l2_pix_format *pix)
{
	int64_t told_ns = wanted->row_time_ns;

	if (wanted->shutter != SHUTTER_ROLLING)
		return 0;
	if (!told_ns)
		told_ns = v4l2_row_time_ns(device, (int)pix->width);
	return told_ns ? told_ns : wanted->readout_ns / pix->height;
}

int v4l2_configure_device(const struct v4l2_device *device, const struct camera_mode *wanted,
			  struct camera_mode *granted, struct v4l2_layout *layout,
			  struct diag *diag)
{
	struct mode_setting s = {.device = device, .wanted = wanted, .diag = diag};
	struct camera_mode mode = {.triggered = wanted->triggered,
				   .readout_ns = wanted->readout_ns};
	struct v4l2_pix_format pix = {0};
	int error = choose_format(&s);

	if (!error)
		error = set_format(&s, &pix);
	if (!error)
		error = make_layout(&s, &pix, layout);
	if (!error)
		error = set_rate(&s, &mode.period_ns);
	if (!error)
		error = v4l2_set_light(device, wanted, diag);
	if (!error)
		error = v4l2_set_controls(device, wanted, &mode, diag);
	if (error)
		return error;
	mode.width_px = (int)pix.width;
	mode.height_px = (int)pix.height;
	mode.format = s.takes_luma ? PIXEL_GREY8 : s.chosen->format;
	mode.bits = s.chosen->bits;
	mode.exposure_ns = v4l2_exposure_ns(device);
	mode.shutter = wanted->shutter;
	mode.row_time_ns = row_time_ns(device, wanted, &pix);
	*granted = mode;
	return 0;
}
