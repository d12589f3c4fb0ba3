/*
 * Puts actors and cameras together, and answers when each shot is.
 */
#include "sim/world/scene.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "sim/world/scene_file.h"
#include "sim/world/scene_parts.h"
#include "sim/world/world_parts.h"

#define DEFAULT_HD_DIVIDER 4

int sim_scene_create(struct sim_scene **out, const struct sim_options *options, struct diag *diag)
{
	struct sim_scene *scene = calloc(1, sizeof(*scene));

	if (!scene)
		return -ENOMEM;
	int err = sim_script_load(&scene->script, options, diag);

	if (err) {
		free(scene);
		return err;
	}
	scene->seed = options->seed;
	scene->rate_hz = scene->script.rate_hz;
	scene->period_ns = llround((double)NS_PER_S / scene->rate_hz);
	scene->camera_count = scene->script.camera_count;
	scene->hd_count = scene->script.hd_camera_count;
	/* before a board all expose together, as a plan for calibration has it */
	scene->hd_divider = options->hd_divider   ? options->hd_divider
			    : scene->script.board ? 1
						  : DEFAULT_HD_DIVIDER;
	scene->hd_phase = options->hd_phase % scene->hd_divider;
	scene->hd_after_ir_ns = scene->script.board ? 0 : options->hd_after_ir_ns;
	scene->hd_row_ns =
		options->hd_row_ns ? options->hd_row_ns : llround(1e3 * scene->script.hd_row_us);
	sim_cameras_init(scene->cameras, scene->camera_count, &scene->script, options->seed);
	sim_hd_cameras_init(scene->cameras + scene->camera_count, scene->hd_count, &scene->script,
			    options->seed);
	sim_board_init(&scene->board, scene->script.placement, options->seed);
	if (options->board)
		sim_board_reach(&scene->board);
	scene_set_windows(scene);
	err = scene_bump_cameras(scene);
	if (!err)
		err = scene_cast(scene, diag);
	if (err) {
		sim_scene_destroy(scene);
		return err;
	}
	*out = scene;
	return 0;
}

void sim_scene_destroy(struct sim_scene *scene)
{
	if (scene)
		free(scene->bumps);
	free(scene);
}

struct exposure scene_exposure(const struct sim_scene *scene, uint32_t camera, uint64_t shot)
{
	if (camera < scene->camera_count)
		return (struct exposure){.mid_s = 1e-9 *
						  (double)sim_scene_mid_exposure_ns(scene, shot),
					 .length_s = 2e-9 * (double)SIM_HALF_EXPOSURE_NS};
	return (struct exposure){.mid_s = 1e-9 * (double)sim_scene_hd_mid_exposure_ns(scene, shot),
				 .row_s = 1e-9 * (double)scene->hd_row_ns,
				 .length_s = 2e-9 * (double)SIM_HD_HALF_EXPOSURE_NS};
}

uint32_t sim_scene_camera_count(const struct sim_scene *scene)
{
	return scene->camera_count;
}

uint32_t sim_scene_hd_count(const struct sim_scene *scene)
{
	return scene->hd_count;
}

const char *sim_scene_camera_name(const struct sim_scene *scene, uint32_t camera)
{
	return scene->cameras[camera].name;
}

const struct sim_script *sim_scene_script(const struct sim_scene *scene)
{
	return &scene->script;
}

const struct board *sim_scene_board(const struct sim_scene *scene)
{
	return &scene->board.print;
}

const struct layout *sim_scene_layout(const struct sim_scene *scene)
{
	return &scene->layout;
}

int64_t sim_scene_mid_exposure_ns(const struct sim_scene *scene, uint64_t shot)
{
	return (int64_t)shot * scene->period_ns + scene->period_ns / 2;
}

int64_t sim_scene_period_ns(const struct sim_scene *scene)
{
	return scene->period_ns;
}

uint64_t sim_scene_hd_shot(const struct sim_scene *scene, uint64_t k)
{
	return k * scene->hd_divider + scene->hd_phase;
}

int64_t sim_scene_hd_mid_exposure_ns(const struct sim_scene *scene, uint64_t shot)
{
	return sim_scene_mid_exposure_ns(scene, shot) + scene->hd_after_ir_ns;
}
