/*
 * The eye of the tests of corners.
 */
#include "calib_look.h"

#include <math.h>
#include <time.h>

#include "sim/render/render.h"

struct sim_scene *look_scene(const char *optics, uint32_t camera_count)
{
	const struct sim_options options = {
		.scene = "board", .seed = 3, .camera_count = camera_count, .optics = optics};
	struct sim_scene *scene;

	return sim_scene_create(&scene, &options, NULL) ? NULL : scene;
}

static double thread_cpu_s(void)
{
	struct timespec now;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
	return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static void add_corners(struct look *look, const struct corners *corners,
			const struct sim_board_corner *truth, const struct board *board)
{
	bool readable = corners->square_px > LOOK_READABLE_PX;

	for (int i = 0; i < board_corner_count(board); i++) {
		double x = corners->px[i][0] - truth[i].pixel[0];
		double y = corners->px[i][1] - truth[i].pixel[1];

		look->in_sight += truth[i].seen && readable;
		if (isnan(x + y))
			continue;
		look->found += readable;
		look->worst_px = fmax(look->worst_px, hypot(x, y));
		if (corners->square_px < LOOK_SQUARE_MIN_PX)
			continue;
		look->measured++;
		look->mean[0] += x;
		look->mean[1] += y;
		look->sum += (x * x + y * y) / 2;
	}
}

int look_at(struct look *look, struct corner_finder *finder, const struct sim_scene *scene,
	    uint32_t camera, uint32_t shot_count, uint32_t shot_step)
{
	struct sim_board_corner truth[BOARD_CORNER_MAX];
	struct corners corners;
	struct sim_renderer *renderer;
	int err = sim_renderer_create(&renderer, scene, camera, SIM_NOISE_FULL);

	if (err)
		return err;
	for (uint32_t i = 0; !err && i < shot_count; i++) {
		uint64_t shot = 5 + (uint64_t)i * shot_step;
		struct exposure exposure = scene_exposure(scene, camera, shot);
		struct grey_image image;

		image.pixels = sim_render(renderer, shot, &image.width_px, &image.height_px);
		image.stride_bytes = image.width_px;
		image.bits = 8;
		sim_board_corners(&scene->board, &scene->cameras[camera], &exposure, truth);
		double start_s = thread_cpu_s();
		err = corner_finder_run(finder, &image, &corners);
		look->seconds += thread_cpu_s() - start_s;
		look->pictures++;
		add_corners(look, &corners, truth, &scene->board.print);
	}
	sim_renderer_destroy(renderer);
	return err;
}
