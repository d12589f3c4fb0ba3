/*
 * From addresses to open, configured cameras.
 */
#include "drivers/open_cameras.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/frame_image.h"

/* All rows of a rolling shutter are open together from when the last one opens until the first one
 * closes: the strobe must burn then, or rows see different instants. */
static int check_shutter(const struct config *config, const struct config_camera *camera,
			 const struct camera_mode *granted, struct diag *diag)
{
	const struct trigger_plan *plan = &config->plan;
	int64_t exposure_ns = granted->exposure_ns ? granted->exposure_ns : plan->ir_exposure_ns;
	int64_t open_ns = plan->ir_delay_ns + granted->row_time_ns * (granted->height_px - 1);
	int64_t shut_ns = plan->ir_delay_ns + exposure_ns;

	if (!granted->row_time_ns ||
	    (plan->strobe_width_ns > 0 && plan->strobe_delay_ns >= open_ns &&
	     plan->strobe_delay_ns + plan->strobe_width_ns <= shut_ns))
		return 0;
	diag_add(diag,
		 "camera %s: %s has a rolling shutter, of which all rows are open from %.6g to "
		 "%.6g us after the edge: an IR camera needs a global shutter, or a strobe inside "
		 "that time (a longer exposure widens it, and readout_us says how long it reads)",
		 camera->name, camera->address, (double)open_ns / NS_PER_US,
		 (double)shut_ns / NS_PER_US);
	return -EINVAL;
}

static int check_images(const struct stage *stage, uint32_t index,
			const struct camera_mode *granted, struct diag *diag)
{
	const struct config_camera *camera = &stage->config.cameras[index];

	if (camera->has_format && granted->format != camera->wanted.format) {
		diag_add(diag,
			 "camera %s: %s gives %s where its format is %s: take the format out, or "
			 "choose one that the camera has",
			 camera->name, camera->address, pixel_format_name(granted->format),
			 pixel_format_name(camera->wanted.format));
		return -EINVAL;
	}
	if (camera->role != ROLE_IR)
		return 0;
	if (!pixels_are_grey(granted->format)) {
		diag_add(
			diag,
			"camera %s: %s delivers no grey images of 8 or 16 bits, which an IR camera "
			"must; set its pixel format to Mono8 or its role to hd",
			camera->name, camera->address);
		return -EINVAL;
	}
	int err = check_shutter(&stage->config, camera, granted, diag);

	if (err || !stage->has_rig)
		return err;
	return rig_check_size(&stage->rig, stage->view_index[index], granted->width_px,
			      granted->height_px, diag);
}

int open_camera_by_config(struct open_camera *out, const struct stage *stage, uint32_t index,
			  const struct camera_driver *const *drivers, uint32_t fires,
			  struct diag *diag)
{
	const struct config_camera *wanted = &stage->config.cameras[index];
	struct open_camera opened = {0};
	const char *rest;

	opened.driver = camera_driver_find(drivers, wanted->address, &rest, diag);
	if (!opened.driver)
		return -EINVAL;
	if (wanted->wanted.control_count && !opened.driver->has_controls) {
		diag_add(diag, "camera %s: the driver %s has no controls: take them out",
			 wanted->name, opened.driver->name);
		return -EINVAL;
	}
	if ((wanted->wanted.clock || wanted->wanted.receive) && !opened.driver->has_network) {
		diag_add(diag,
			 "camera %s: clock and receive are for cameras on a network, not for the "
			 "driver %s: take them out",
			 wanted->name, opened.driver->name);
		return -EINVAL;
	}
	int err = opened.driver->open(&opened.camera, rest, stage->config.base_dir, diag);
	if (err)
		return err;
	opened.wanted = wanted->wanted;
	opened.wanted.triggered =
		fires & (wanted->role == ROLE_HD ? TRIGGER_FIRES_HD : TRIGGER_FIRES_IR);
	err = opened.driver->configure(opened.camera, &opened.wanted, &opened.granted, diag);
	if (!err)
		err = check_images(stage, index, &opened.granted, diag);
	if (err) {
		opened.driver->close(opened.camera);
		return err;
	}
	*out = opened;
	return 0;
}

int open_cameras(struct open_camera *out, const struct stage *stage, uint32_t camera_mask,
		 const struct camera_driver *const *drivers, uint32_t fires, struct diag *diag)
{
	uint32_t count = stage->config.camera_count;
	int first_err = 0;

	memset(out, 0, count * sizeof(*out));
	for (uint32_t c = 0; c < count; c++) {
		if (!(camera_mask >> c & 1))
			continue;
		int err = open_camera_by_config(&out[c], stage, c, drivers, fires, diag);
		if (err && !first_err)
			first_err = err;
	}
	if (first_err)
		close_cameras(out, count);
	return first_err;
}

void close_cameras(struct open_camera *cameras, uint32_t count)
{
	for (uint32_t c = 0; c < count; c++)
		if (cameras[c].camera)
			cameras[c].driver->close(cameras[c].camera);
	memset(cameras, 0, count * sizeof(*cameras));
}

static int compare_ns(const void *a, const void *b)
{
	int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

	return (x > y) - (x < y);
}

int64_t open_cameras_period_ns(const struct open_camera *cameras, uint32_t camera_mask)
{
	int64_t periods_ns[CAMERA_MAX];
	size_t count = 0;

	for (uint32_t left = camera_mask; left; left &= left - 1) {
		const struct open_camera *camera = &cameras[__builtin_ctz(left)];

		if (camera->granted.period_ns > 0)
			periods_ns[count++] = camera->granted.period_ns;
	}
	qsort(periods_ns, count, sizeof(periods_ns[0]), compare_ns);
	return count ? periods_ns[(count - 1) / 2] : 0;
}
