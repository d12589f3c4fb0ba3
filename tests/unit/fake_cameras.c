/*
 * A camera driver that does what a test tells it, and the program's lists with it alone.
 */
#include "fake_cameras.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/clock_virtual.h"
#include "daemon/program_drivers.h"
#include "drivers/trigger_free.h"
#include "track/observe.h"

struct fake_camera {
	struct camera base;
	_Atomic int *fault;
	int64_t next_ns;
	uint64_t seq;
	bool repeat;
};

_Atomic int fake_faults[CAMERA_COUNT];
_Atomic int fake_open_count;
int64_t fake_period_ns;

static uint8_t black[WIDTH_PX * HEIGHT_PX];

static int fake_list(camera_found_fn *found, void *user, struct diag *diag)
{
	(void)found, (void)user, (void)diag;
	return 0;
}

static int fake_open(struct camera **out, const char *rest, const char *base_dir, struct diag *diag)
{
	_Atomic int *fault = &fake_faults[rest[0] - '0'];
	struct fake_camera *camera;

	(void)base_dir;
	if (atomic_load(fault) == FAULT_GONE) {
		diag_add(diag, "fake:%s: not there: plug it in", rest);
		return -ENODEV;
	}
	camera = calloc(1, sizeof(*camera));
	camera->fault = fault;
	*out = &camera->base;
	fake_open_count++;
	return 0;
}

static void fake_close(struct camera *camera)
{
	if (camera)
		fake_open_count--;
	free(camera);
}

static int fake_configure(struct camera *camera, const struct camera_mode *wanted,
			  struct camera_mode *granted, struct diag *diag)
{
	(void)camera, (void)wanted, (void)diag;
	*granted = (struct camera_mode){
		.width_px = WIDTH_PX, .height_px = HEIGHT_PX, .period_ns = fake_period_ns};
	return 0;
}

static int fake_start(struct camera *base, struct diag *diag)
{
	struct fake_camera *camera = (struct fake_camera *)base;

	if (atomic_load(camera->fault) == FAULT_GONE) {
		diag_add(diag, "fake: does not start: plug it in");
		return -ENODEV;
	}
	/* all cameras expose at whole periods */
	camera->next_ns = (clock_now_ns() / PERIOD_NS + 1) * PERIOD_NS;
	return 0;
}

static void fake_stop(struct camera *camera)
{
	(void)camera;
}

static void fill_frame(struct fake_camera *camera, int fault, struct frame *out)
{
	*out = (struct frame){.pixels = black,
			      .width_px = fault == FAULT_OTHER_SIZE ? WIDTH_PX / 2 : WIDTH_PX,
			      .height_px = HEIGHT_PX,
			      .stride_bytes = WIDTH_PX,
			      .shot = SHOT_UNKNOWN,
			      .device_seq = camera->seq,
			      .mid_exposure_ns = camera->next_ns,
			      .arrival_ns = clock_now_ns()};
	if (fault == FAULT_FOREIGN_CLOCK)
		out->mid_exposure_ns = 42;
}

static int fake_acquire(struct camera *base, int64_t timeout_ns, struct frame *out)
{
	struct fake_camera *camera = (struct fake_camera *)base;
	int fault = atomic_load(camera->fault);

	if (fault == FAULT_GONE || fault == FAULT_OVER)
		return fault == FAULT_GONE ? -ENODEV : -ENODATA;
	if (camera->repeat) {
		camera->repeat = false;
		fill_frame(camera, fault, out);
		return 0;
	}
	if (fault == FAULT_SILENT) {
		clock_sleep_until(clock_now_ns() + timeout_ns / 10);
		camera->next_ns = (clock_now_ns() / PERIOD_NS + 1) * PERIOD_NS;
		return -ETIMEDOUT;
	}
	do {
		camera->next_ns += PERIOD_NS;
		camera->seq++;
	} while (fault == FAULT_GAPS && camera->seq % 2);
	/* each camera is a little later than the one before it */
	clock_sleep_until(camera->next_ns + (camera->fault - fake_faults) * NS_PER_MS / 2);
	camera->repeat = fault == FAULT_REPEAT;
	fill_frame(camera, fault, out);
	return fault == FAULT_DAMAGED ? -EBADMSG : 0;
}

static void fake_release(struct camera *camera, struct frame *frame)
{
	(void)camera, (void)frame;
}

static const struct camera_driver fake_driver = {
	.name = "fake",
	.list = fake_list,
	.open = fake_open,
	.close = fake_close,
	.configure = fake_configure,
	.start = fake_start,
	.stop = fake_stop,
	.acquire = fake_acquire,
	.release = fake_release,
};

const struct camera_driver *const camera_drivers[] = {&fake_driver, NULL};
const struct trigger_driver *const trigger_drivers[] = {&free_trigger_driver, NULL};
