/*
 * A device's controls: by the names that v4l2-ctl shows, and exposure on those of them that have a
 * unit.
 */
#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2_device.h"

#define EXPOSURE_UNIT_NS (100 * NS_PER_US) /* of exposure_time_absolute */

/* "Exposure Time, Absolute" is exposure_time_absolute. */
static void make_name(const char *title, char name[33])
{
	size_t length = 0;

	for (; *title && length < 32; title++)
		if (isalnum((unsigned char)*title))
			name[length++] = (char)tolower((unsigned char)*title);
		else if (length && name[length - 1] != '_')
			name[length++] = '_';
	while (length && name[length - 1] == '_')
		length--;
	name[length] = '\0';
}

static bool can_be_set(const struct v4l2_query_ext_ctrl *control)
{
	switch (control->type) {
	case V4L2_CTRL_TYPE_INTEGER:
	case V4L2_CTRL_TYPE_INTEGER64:
	case V4L2_CTRL_TYPE_BOOLEAN:
	case V4L2_CTRL_TYPE_MENU:
	case V4L2_CTRL_TYPE_INTEGER_MENU:
	case V4L2_CTRL_TYPE_BITMASK:
	case V4L2_CTRL_TYPE_BUTTON:
		return !(control->flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY |
					   V4L2_CTRL_FLAG_HAS_PAYLOAD));
	default:
		return false;
	}
}

/* False when there is none that can be set. */
static bool find_by_id(const struct v4l2_device *device, uint32_t id,
		       struct v4l2_query_ext_ctrl *control)
{
	*control = (struct v4l2_query_ext_ctrl){.id = id};
	return v4l2_ask(device->fd, VIDIOC_QUERY_EXT_CTRL, control) == 0 && can_be_set(control);
}

/* Steps through those that can be set; begin with a zeroed one. */
static bool find_next(const struct v4l2_device *device, struct v4l2_query_ext_ctrl *control)
{
	uint32_t id = control->id;

	do {
		*control = (struct v4l2_query_ext_ctrl){.id = id | V4L2_CTRL_FLAG_NEXT_CTRL};
		if (v4l2_ask(device->fd, VIDIOC_QUERY_EXT_CTRL, control))
			return false;
		id = control->id;
	} while (!can_be_set(control));
	return true;
}

static bool find_by_name(const struct v4l2_device *device, const char *wanted,
			 struct v4l2_query_ext_ctrl *control)
{
	char name[33];

	memset(control, 0, sizeof(*control));
	while (find_next(device, control)) {
		make_name(control->name, name);
		if (strcmp(name, wanted) == 0)
			return true;
	}
	return false;
}

static int refuse_name(const struct v4l2_device *device, const char *wanted, struct diag *diag)
{
	struct v4l2_query_ext_ctrl control = {0};
	char known[1200] = "", name[33];

	while (find_next(device, &control)) {
		size_t used = strlen(known);

		make_name(control.name, name);
		snprintf(known + used, sizeof(known) - used, "%s%s", used ? ", " : "", name);
	}
	diag_add(diag, "%s: controls: the camera has no %s that can be set; it has %s",
		 device->address, wanted, *known ? known : "none");
	return -EINVAL;
}

/* Sets it and reads back what the device made of it. */
static int set_value(const struct v4l2_device *device, const struct v4l2_query_ext_ctrl *control,
		     int64_t *value)
{
	bool is_wide = control->type == V4L2_CTRL_TYPE_INTEGER64;
	struct v4l2_ext_control one = {.id = control->id};
	struct v4l2_ext_controls all = {.count = 1, .controls = &one};
	int error;

	if (is_wide)
		one.value64 = *value;
	else
		one.value = (int32_t)*value;
	error = v4l2_ask(device->fd, VIDIOC_S_EXT_CTRLS, &all);
	if (error || control->flags & V4L2_CTRL_FLAG_WRITE_ONLY)
		return error;
	error = v4l2_ask(device->fd, VIDIOC_G_EXT_CTRLS, &all);
	if (!error)
		*value = is_wide ? one.value64 : one.value;
	return error;
}

/* Nothing happens where the device has no such control. */
static int set_if_there(const struct v4l2_device *device, uint32_t id, int64_t value)
{
	struct v4l2_query_ext_ctrl control;

	return find_by_id(device, id, &control) ? set_value(device, &control, &value) : 0;
}

static int set_control(const struct v4l2_device *device, struct camera_control *wanted,
		       struct diag *diag)
{
	struct v4l2_query_ext_ctrl control;
	char doing[96];

	if (!find_by_name(device, wanted->name, &control))
		return refuse_name(device, wanted->name, diag);
	if (control.type != V4L2_CTRL_TYPE_BITMASK && control.type != V4L2_CTRL_TYPE_BUTTON &&
	    (wanted->value < control.minimum || wanted->value > control.maximum)) {
		diag_add(diag,
			 "%s: controls: %s: %" PRId64 " is outside %" PRId64 " to %" PRId64
			 " (the camera's own is %" PRId64 ")",
			 device->address, wanted->name, wanted->value, (int64_t)control.minimum,
			 (int64_t)control.maximum, (int64_t)control.default_value);
		return -EINVAL;
	}
	snprintf(doing, sizeof(doing), "controls: %s: %" PRId64, wanted->name, wanted->value);
	int error = set_value(device, &control, &wanted->value);

	return error ? v4l2_fail(device, error, doing, diag) : 0;
}

int v4l2_set_controls(const struct v4l2_device *device, const struct camera_mode *wanted,
		      struct camera_mode *granted, struct diag *diag)
{
	for (int c = 0; c < wanted->control_count; c++) {
		struct camera_control control = wanted->controls[c];
		int error = set_control(device, &control, diag);

		if (error)
			return error;
		granted->controls[c] = control;
		granted->control_count = c + 1;
	}
	return 0;
}

static int64_t clamped(int64_t value, const struct v4l2_query_ext_ctrl *control)
{
	return value < control->minimum   ? control->minimum
	       : value > control->maximum ? control->maximum
					  : value;
}

/* With the camera's own automatic switched off. */
static int set_exposure(const struct v4l2_device *device, int64_t exposure_ns, struct diag *diag)
{
	struct v4l2_query_ext_ctrl control;
	int64_t value = (exposure_ns + EXPOSURE_UNIT_NS / 2) / EXPOSURE_UNIT_NS;
	int error;

	if (!find_by_id(device, V4L2_CID_EXPOSURE_ABSOLUTE, &control)) {
		diag_add(diag,
			 "%s: exposure_us: the camera has no exposure in units of time "
			 "(exposure_time_absolute): take exposure_us out and set its own under "
			 "controls",
			 device->address);
		return -ENOTSUP;
	}
	error = set_if_there(device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
	if (!error)
		error = set_if_there(device, V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0);
	value = clamped(value, &control);
	if (!error)
		error = set_value(device, &control, &value);
	return error ? v4l2_fail(device, error, "exposure_us", diag) : 0;
}

/* V4L2 gives gains no unit, so decibels cannot be set. */
static int refuse_gain(const struct v4l2_device *device, struct diag *diag)
{
	static const struct {
		uint32_t id;
		const char *name;
	} gains[] = {{V4L2_CID_ANALOGUE_GAIN, "analogue_gain"}, {V4L2_CID_GAIN, "gain"}};
	struct v4l2_query_ext_ctrl control;

	for (size_t g = 0; g < 2; g++)
		if (find_by_id(device, gains[g].id, &control)) {
			diag_add(diag,
				 "%s: gain_db: V4L2 knows no decibels: write controls: {%s: N}, "
				 "%" PRId64 " to %" PRId64,
				 device->address, gains[g].name, (int64_t)control.minimum,
				 (int64_t)control.maximum);
			return -ENOTSUP;
		}
	diag_add(diag, "%s: gain_db: the camera has no gain that can be set: take it out",
		 device->address);
	return -ENOTSUP;
}

/* -1: not told. */
static int64_t read_value(const struct v4l2_device *device, uint32_t id, bool is_wide)
{
	struct v4l2_ext_control one = {.id = id};
	struct v4l2_ext_controls all = {.count = 1, .controls = &one};

	if (v4l2_ask(device->fd, VIDIOC_G_EXT_CTRLS, &all))
		return -1;
	return is_wide ? one.value64 : one.value;
}

int64_t v4l2_exposure_ns(const struct v4l2_device *device)
{
	int64_t automatic = read_value(device, V4L2_CID_EXPOSURE_AUTO, false);
	int64_t exposure = read_value(device, V4L2_CID_EXPOSURE_ABSOLUTE, false);

	if (automatic != -1 && automatic != V4L2_EXPOSURE_MANUAL &&
	    automatic != V4L2_EXPOSURE_SHUTTER_PRIORITY)
		return 0;
	return exposure > 0 ? exposure * EXPOSURE_UNIT_NS : 0;
}

/* Some capture drivers show the controls of their sensor (kernel documentation, "Camera sensor
 * drivers"). */
int64_t v4l2_row_time_ns(const struct v4l2_device *device, int width_px)
{
	int64_t rate_hz = read_value(device, V4L2_CID_PIXEL_RATE, true);
	int64_t blank_px = read_value(device, V4L2_CID_HBLANK, false);

	if (rate_hz <= 0 || blank_px < 0)
		return 0;
	return (int64_t)((double)(width_px + blank_px) * NS_PER_S / (double)rate_hz);
}

int v4l2_set_light(const struct v4l2_device *device, const struct camera_mode *wanted,
		   struct diag *diag)
{
	if (wanted->gain_db > 0)
		return refuse_gain(device, diag);
	return wanted->exposure_ns > 0 ? set_exposure(device, wanted->exposure_ns, diag) : 0;
}
