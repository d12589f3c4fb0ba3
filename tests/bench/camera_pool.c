/*
 * `pool:N`: a camera that costs nothing, so that a station's CPU and latency are its own. Frames
 * lie ready; acquire waits for the instant and lends one.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "daemon/program_drivers.h"
#include "drivers/trigger_free.h"
#include "tests/bench/frame_pool.h"

#define QUEUE_MAX 16 /* frames that wait for a late station */
#define TRANSFER_NS (2 * NS_PER_MS)

struct pool_camera {
	struct camera camera;
	struct frame_pool pool;
	uint64_t next_frame;
};

static int pool_list(camera_found_fn *found, void *user, struct diag *diag)
{
	(void)found;
	(void)user;
	(void)diag;
	return 0;
}

static const struct camera_driver pool_driver;

static int pool_open(struct camera **out, const char *rest, const char *base_dir, struct diag *diag)
{
	struct pool_camera *self = calloc(1, sizeof(*self));

	(void)base_dir;
	if (!self)
		return -ENOMEM;
	self->camera.driver = &pool_driver;
	int err = frame_pool_init(&self->pool, 1, (uint32_t)atoi(rest));
	if (err) {
		diag_add(diag, "pool:%s: %s", rest, strerror(-err));
		free(self);
		return err;
	}
	*out = &self->camera;
	return 0;
}

static void pool_close(struct camera *camera)
{
	struct pool_camera *self = (struct pool_camera *)camera;

	if (self)
		frame_pool_finish(&self->pool);
	free(self);
}

static int pool_configure(struct camera *camera, const struct camera_mode *wanted,
			  struct camera_mode *granted, struct diag *diag)
{
	struct pool_camera *self = (struct pool_camera *)camera;

	(void)diag;
	*granted = *wanted;
	granted->width_px = self->pool.width_px;
	granted->height_px = self->pool.height_px;
	granted->format = PIXEL_GREY8;
	granted->period_ns = POOL_PERIOD_NS;
	return 0;
}

static int pool_start(struct camera *camera, struct diag *diag)
{
	(void)camera;
	(void)diag;
	return 0;
}

static void pool_stop(struct camera *camera)
{
	(void)camera;
}

static int pool_acquire(struct camera *camera, int64_t timeout_ns, struct frame *out)
{
	struct pool_camera *self = (struct pool_camera *)camera;
	int64_t now_ns = clock_now_ns(), due_ns;
	uint64_t newest = frame_pool_next(now_ns, &due_ns);

	if (self->next_frame == 0 || self->next_frame + QUEUE_MAX < newest)
		self->next_frame = newest;
	due_ns = (int64_t)self->next_frame * POOL_PERIOD_NS;
	if (due_ns > now_ns + timeout_ns) {
		clock_sleep_until(now_ns + timeout_ns);
		return -ETIMEDOUT;
	}
	clock_sleep_until(due_ns);
	*out = (struct frame){.pixels = frame_pool_at(&self->pool, self->next_frame),
			      .width_px = self->pool.width_px,
			      .height_px = self->pool.height_px,
			      .stride_bytes = self->pool.width_px,
			      .format = PIXEL_GREY8,
			      .shot = UINT64_MAX,
			      .device_seq = self->next_frame,
			      .mid_exposure_ns = due_ns - TRANSFER_NS,
			      .uncertainty_ns = 1000,
			      .arrival_ns = due_ns};
	self->next_frame++;
	return 0;
}

static void pool_release(struct camera *camera, struct frame *frame)
{
	(void)camera;
	(void)frame;
}

static const struct camera_driver pool_driver = {
	.name = "pool",
	.list = pool_list,
	.open = pool_open,
	.close = pool_close,
	.configure = pool_configure,
	.start = pool_start,
	.stop = pool_stop,
	.acquire = pool_acquire,
	.release = pool_release,
};

/* In place of the station's own lists. */
const struct camera_driver *const camera_drivers[] = {&pool_driver, NULL};
const struct trigger_driver *const trigger_drivers[] = {&free_trigger_driver, NULL};
