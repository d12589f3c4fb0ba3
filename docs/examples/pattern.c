/*
 * A camera that is not there: it draws a bright spot that moves to the right by a pixel a frame.
 */
#include "pattern.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "track/observe.h"

#define WIDTH_PX 320
#define HEIGHT_PX 240
#define SPOT_PX 6
#define PERIOD_NS (10 * NS_PER_MS)
#define EXPOSURE_NS (1 * NS_PER_MS)

struct pattern {
	struct camera base; /* first, so that a camera can be cast to it */
	/* owned by the capture thread while started */
	int64_t first_ns; /* middle of the exposure of frame 0 */
	int64_t next;     /* frame to lend */
	uint8_t pixels[HEIGHT_PX][WIDTH_PX];
};

static int pattern_list(camera_found_fn *found, void *user, struct diag *diag)
{
	(void)diag;
	found(&(struct camera_info){"pattern:spot", "test pattern", "0"}, user);
	return 0;
}

static int pattern_open(struct camera **out, const char *rest, const char *base_dir,
			struct diag *diag)
{
	struct pattern *pattern;

	(void)base_dir;
	if (strcmp(rest, "spot") != 0) {
		diag_add(diag, "pattern:%s: no such pattern; use pattern:spot", rest);
		return -ENODEV;
	}
	pattern = calloc(1, sizeof(*pattern));
	if (!pattern) {
		diag_add(diag, "pattern:%s: out of memory", rest);
		return -ENOMEM;
	}
	pattern->base.driver = &pattern_camera_driver;
	*out = &pattern->base;
	return 0;
}

static void pattern_close(struct camera *camera)
{
	free(camera);
}

static int pattern_configure(struct camera *camera, const struct camera_mode *wanted,
			     struct camera_mode *granted, struct diag *diag)
{
	(void)camera, (void)wanted, (void)diag;
	*granted = (struct camera_mode){.width_px = WIDTH_PX,
					.height_px = HEIGHT_PX,
					.format = PIXEL_GREY8,
					.period_ns = PERIOD_NS,
					.exposure_ns = EXPOSURE_NS};
	return 0;
}

static int pattern_start(struct camera *camera, struct diag *diag)
{
	struct pattern *pattern = (struct pattern *)camera;

	(void)diag;
	pattern->first_ns = clock_now_ns();
	pattern->next = 0;
	return 0;
}

static void pattern_stop(struct camera *camera)
{
	(void)camera;
}

static void draw(struct pattern *pattern)
{
	memset(pattern->pixels, 0, sizeof(pattern->pixels));
	for (int row = 0; row < SPOT_PX; row++)
		memset(&pattern->pixels[HEIGHT_PX / 2 + row][pattern->next % (WIDTH_PX - SPOT_PX)],
		       200, SPOT_PX);
}

static int pattern_acquire(struct camera *camera, int64_t timeout_ns, struct frame *out)
{
	struct pattern *pattern = (struct pattern *)camera;
	int64_t give_up_ns = clock_now_ns() + timeout_ns;
	int64_t mid_exposure_ns = pattern->first_ns + pattern->next * PERIOD_NS;
	int64_t ready_ns = mid_exposure_ns + EXPOSURE_NS / 2;

	clock_sleep_until(ready_ns < give_up_ns ? ready_ns : give_up_ns);
	if (ready_ns > give_up_ns)
		return -ETIMEDOUT;
	draw(pattern);
	*out = (struct frame){.pixels = pattern->pixels[0],
			      .width_px = WIDTH_PX,
			      .height_px = HEIGHT_PX,
			      .stride_bytes = WIDTH_PX,
			      .format = PIXEL_GREY8,
			      .shot = SHOT_UNKNOWN,
			      .device_seq = (uint64_t)pattern->next++,
			      .mid_exposure_ns = mid_exposure_ns,
			      .uncertainty_ns = 1 * NS_PER_US,
			      .arrival_ns = clock_now_ns()};
	return 0;
}

static void pattern_release(struct camera *camera, struct frame *frame)
{
	(void)camera;
	frame->pixels = NULL;
}

const struct camera_driver pattern_camera_driver = {
	.name = "pattern",
	.list = pattern_list,
	.open = pattern_open,
	.close = pattern_close,
	.configure = pattern_configure,
	.start = pattern_start,
	.stop = pattern_stop,
	.acquire = pattern_acquire,
	.release = pattern_release,
};
