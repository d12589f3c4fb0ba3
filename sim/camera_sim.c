/*
 * Camera driver `sim:NAME`: renders the shots of this process's simulated stage on demand.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "sim/picture.h"
#include "sim/world/scene_parts.h"
#include "sim/world/world.h"
#include "sim/world/world_parts.h"
#include "track/observe.h"

#define QUEUE_FRAMES 8 /* what a camera holds for a late station */
#define UNCERTAINTY_NS (1 * NS_PER_US)
#define LATE_NS (2 * NS_PER_MS) /* of the simulator, not of the station */

/* Frame n of an IR camera is shot n, that of an HD camera the n-th of those that HD exposes in. */
struct sim_device {
	struct camera base;
	/* set on the control thread */
	uint64_t world_serial;           /* of what it looks at */
	const struct sim_camera *camera; /* the scene's */
	uint32_t index;
	bool is_hd;
	int64_t period_ns, half_exposure_ns, row_ns;
	struct sim_picture *picture; /* owned */
	/* owned by the capture thread */
	uint64_t next_frame;
	uint64_t uncounted; /* frames until now that its counter leaves out */
	bool repeats;       /* next_frame was handed over already */
};

static struct sim_device *device_of(struct camera *camera)
{
	return (struct sim_device *)camera;
}

static uint64_t shot_of(const struct sim_device *device, uint64_t frame)
{
	return device->is_hd ? sim_scene_hd_shot(sim_world_scene(), frame) : frame;
}

static int64_t mid_exposure_ns(const struct sim_device *device, uint64_t frame)
{
	uint64_t shot = shot_of(device, frame);

	return device->is_hd ? sim_world_epoch_ns() +
				       sim_scene_hd_mid_exposure_ns(sim_world_scene(), shot)
			     : sim_world_mid_exposure_ns(shot);
}

static int64_t ready_ns(const struct sim_device *device, uint64_t frame)
{
	return mid_exposure_ns(device, frame) + device->half_exposure_ns +
	       device->row_ns * device->camera->height_px / 2 + SIM_READOUT_NS;
}

static sim_fault_mask faults_at(const struct sim_device *device, int64_t time_ns)
{
	return sim_faults_of(sim_world_faults(), device->camera->name,
			     time_ns - sim_world_epoch_ns(), device->period_ns);
}

static bool is_unplugged(const struct sim_device *device)
{
	return faults_at(device, clock_now_ns()) & SIM_FAULT_BIT(SIM_FAULT_UNPLUG);
}

static int sim_list(camera_found_fn *found, void *user, struct diag *diag)
{
	const struct sim_scene *scene = sim_world_scene();

	(void)diag;
	for (uint32_t c = 0; scene && c < scene->camera_count + scene->hd_count; c++) {
		struct camera_info info;

		snprintf(info.address, sizeof(info.address), "sim:%s", scene->cameras[c].name);
		snprintf(info.model, sizeof(info.model), "simulated %dx%d",
			 scene->cameras[c].width_px, scene->cameras[c].height_px);
		snprintf(info.serial, sizeof(info.serial), "sim-%u", c);
		found(&info, user);
	}
	return 0;
}

static int find_camera(const struct sim_scene *scene, const char *name, uint32_t *index,
		       struct diag *diag)
{
	char names[SIM_DEVICE_MAX * 16] = "";

	if (!scene) {
		diag_add(diag, "sim:%s: no simulated stage is open in this program", name);
		return -ENODEV;
	}
	for (uint32_t c = 0; c < scene->camera_count + scene->hd_count; c++) {
		if (strcmp(scene->cameras[c].name, name) == 0) {
			*index = c;
			return 0;
		}
		snprintf(names + strlen(names), sizeof(names) - strlen(names), " %.12s",
			 scene->cameras[c].name);
	}
	diag_add(diag, "sim:%s: no such camera: the scene has%s", name, names);
	return -ENODEV;
}

static void set_timing(struct sim_device *device, const struct sim_scene *scene)
{
	device->period_ns = scene->period_ns * (device->is_hd ? scene->hd_divider : 1);
	device->row_ns = device->is_hd ? scene->hd_row_ns : 0;
	device->half_exposure_ns = device->is_hd ? SIM_HD_HALF_EXPOSURE_NS : SIM_HALF_EXPOSURE_NS;
}

/* At what the world shows now. Returns 0 or -ENOMEM. */
static int look(struct sim_device *device)
{
	const struct sim_scene *scene = sim_world_scene();
	struct sim_picture *picture;
	int err = sim_picture_create(&picture, scene, device->index, SIM_NOISE_FAST);

	if (err)
		return err;
	sim_picture_destroy(device->picture);
	device->picture = picture;
	device->camera = &scene->cameras[device->index];
	device->is_hd = device->index >= scene->camera_count;
	device->world_serial = sim_world_serial();
	set_timing(device, scene);
	return 0;
}

static void sim_close(struct camera *camera)
{
	if (!camera)
		return;
	sim_picture_destroy(device_of(camera)->picture);
	free(camera);
}

static int sim_open(struct camera **out, const char *rest, const char *base_dir, struct diag *diag)
{
	const struct sim_scene *scene = sim_world_scene();
	uint32_t index;
	int err = find_camera(scene, rest, &index, diag);

	(void)base_dir;
	if (err)
		return err;
	struct sim_device *device = calloc(1, sizeof(*device));

	if (!device)
		goto fail;
	device->base.driver = &sim_camera_driver;
	device->index = index;
	err = look(device);
	if (err)
		goto fail;
	if (is_unplugged(device)) {
		diag_add(diag, "sim:%s: unplugged, as sim.faults says; it will be back", rest);
		sim_close(&device->base);
		return -ENODEV;
	}
	*out = &device->base;
	return 0;
fail:
	sim_close(device ? &device->base : NULL);
	diag_add(diag, "sim:%s: out of memory", rest);
	return -ENOMEM;
}

/* What it looked at last may be gone. */
static int look_again(struct sim_device *device, struct diag *diag)
{
	int err = device->world_serial == sim_world_serial() ? 0 : look(device);

	if (err)
		diag_add(diag, "sim:%s: out of memory",
			 sim_world_scene()->cameras[device->index].name);
	return err;
}

static int sim_configure(struct camera *camera, const struct camera_mode *wanted,
			 struct camera_mode *granted, struct diag *diag)
{
	struct sim_device *device = device_of(camera);
	int err = look_again(device, diag);

	if (err)
		return err;
	*granted = (struct camera_mode){
		.width_px = device->camera->width_px,
		.height_px = device->camera->height_px,
		.format = device->is_hd ? PIXEL_BAYER_RG8 : PIXEL_GREY8,
		.period_ns = device->period_ns,
		.exposure_ns = 2 * device->half_exposure_ns,
		.triggered = wanted->triggered,
	};
	return 0;
}

static int sim_start(struct camera *camera, struct diag *diag)
{
	struct sim_device *device = device_of(camera);
	const struct sim_scene *scene = sim_world_scene();
	uint64_t shot = sim_world_shot_after(clock_now_ns());
	int err = look_again(device, diag);

	if (err)
		return err;
	device->next_frame = shot;
	if (device->is_hd)
		device->next_frame = shot <= scene->hd_phase
					     ? 0
					     : (shot - scene->hd_phase + scene->hd_divider - 1) /
						       scene->hd_divider;
	device->repeats = false;
	device->uncounted = 0;
	if (sim_faults_was_unplugged(sim_world_faults(), device->camera->name,
				     clock_now_ns() - sim_world_epoch_ns()))
		device->uncounted = device->next_frame;
	return 0;
}

static void sim_stop(struct camera *camera)
{
	(void)camera;
}

/* Moves past the frames that a camera with QUEUE_FRAMES places has had to drop by now. */
static void drop_oldest(struct sim_device *device, int64_t now_ns)
{
	int64_t age_ns = now_ns - ready_ns(device, device->next_frame);
	int64_t ready_count = age_ns / device->period_ns + 1;

	if (age_ns > 0 && ready_count > QUEUE_FRAMES)
		device->next_frame += (uint64_t)(ready_count - QUEUE_FRAMES);
}

static void fill(struct sim_device *device, uint64_t frame, sim_fault_mask faults,
		 struct frame *out)
{
	const sim_fault_mask late_stamp =
		SIM_FAULT_BIT(SIM_FAULT_STAMP_SHIFT) | SIM_FAULT_BIT(SIM_FAULT_PHASE_SLIP);
	int64_t exposed_ns = mid_exposure_ns(device, frame);
	int64_t clock_off_ns = sim_faults_clock_off_ns(sim_world_faults(), device->camera->name,
						       exposed_ns - sim_world_epoch_ns());
	int width_px, height_px;

	*out = (struct frame){.pixels = sim_picture_take(device->picture, shot_of(device, frame),
							 faults, sim_world_strobes_lit(), &width_px,
							 &height_px),
			      .width_px = device->camera->width_px,
			      .height_px = device->camera->height_px,
			      .stride_bytes = device->camera->width_px,
			      .format = device->is_hd ? PIXEL_BAYER_RG8 : PIXEL_GREY8,
			      .shot = SHOT_UNKNOWN,
			      .device_seq = frame - device->uncounted,
			      .mid_exposure_ns = exposed_ns + clock_off_ns,
			      .uncertainty_ns = UNCERTAINTY_NS,
			      .row_time_ns = device->row_ns,
			      .arrival_ns = clock_now_ns()};
	if (faults & late_stamp)
		out->mid_exposure_ns += sim_scene_period_ns(sim_world_scene());
}

/* Steps over the frames that faults keep back, at most to `until_ns`. */
static void skip_kept_back(struct sim_device *device, int64_t until_ns)
{
	const sim_fault_mask uncounted =
		SIM_FAULT_BIT(SIM_FAULT_MISS) | SIM_FAULT_BIT(SIM_FAULT_FREEZE);

	while (!device->repeats && ready_ns(device, device->next_frame) <= until_ns) {
		sim_fault_mask faults =
			faults_at(device, mid_exposure_ns(device, device->next_frame));

		if (!(faults & (uncounted | SIM_FAULT_BIT(SIM_FAULT_DROP))))
			return;
		device->uncounted += (faults & uncounted) != 0;
		device->next_frame++;
	}
}

/* When the next frame is handed over. */
static int64_t due_ns(const struct sim_device *device, sim_fault_mask faults, int64_t asked_ns)
{
	int64_t time_ns = mid_exposure_ns(device, device->next_frame);
	int64_t due = ready_ns(device, device->next_frame);

	if (faults & SIM_FAULT_BIT(SIM_FAULT_DELAY))
		due += sim_faults_delay_ns(sim_world_faults(), device->camera->name,
					   time_ns - sim_world_epoch_ns());
	return due > asked_ns ? due : asked_ns;
}

static int sim_acquire(struct camera *camera, int64_t timeout_ns, struct frame *out)
{
	struct sim_device *device = device_of(camera);
	int64_t asked_ns = clock_now_ns();

	if (is_unplugged(device))
		return -ENODEV;
	drop_oldest(device, asked_ns);
	skip_kept_back(device, asked_ns + timeout_ns);
	uint64_t frame = device->next_frame;
	sim_fault_mask faults = faults_at(device, mid_exposure_ns(device, frame));
	int64_t due = due_ns(device, faults, asked_ns);

	if (due - asked_ns > timeout_ns) {
		clock_sleep_until(asked_ns + timeout_ns);
		return -ETIMEDOUT;
	}
	clock_sleep_until(due);
	device->repeats = !device->repeats && (faults & SIM_FAULT_BIT(SIM_FAULT_REPEAT));
	device->next_frame = frame + !device->repeats;
	fill(device, frame, faults, out);
	if (out->arrival_ns - due > LATE_NS)
		sim_world_count_late(device->index);
	return 0;
}

static void sim_release(struct camera *camera, struct frame *frame)
{
	(void)camera;
	frame->pixels = NULL;
}

const struct camera_driver sim_camera_driver = {
	.name = "sim",
	.list = sim_list,
	.open = sim_open,
	.close = sim_close,
	.configure = sim_configure,
	.start = sim_start,
	.stop = sim_stop,
	.acquire = sim_acquire,
	.release = sim_release,
};
