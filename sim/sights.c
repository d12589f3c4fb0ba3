/*
 * Sights of markers and corners.
 */
#include "sim/sights.h"

#include <errno.h>
#include <stdlib.h>

#include "sim/scene_parts.h"

#define ROLLING_STEPS 4

void sim_rolling_init(struct sim_rolling *rolling, const struct sim_scene *scene, uint32_t camera,
		      uint64_t shot)
{
	struct exposure exposure = scene_exposure(scene, camera, shot);
	int rows = scene->cameras[camera].height_px;

	rolling->row_count = rows;
	rolling->rolls = exposure.row_s != 0;
	scene_pose_markers(scene, exposure.mid_s, &rolling->at[1]);
	for (int end = 0; rolling->rolls && end <= 2; end += 2) {
		double time_s = exposure_of_row_s(&exposure, end ? rows - 1 : 0, rows);

		scene_pose_markers(scene, fmax(0, time_s), &rolling->at[end]);
	}
}

/* The parabola through a, b and c at -1, 0 and 1. */
static struct vec3 between(struct vec3 a, struct vec3 b, struct vec3 c, double place)
{
	double wa = 0.5 * place * (place - 1), wc = 0.5 * place * (place + 1);

	return vec3_add(vec3_scale(b, 1 - wa - wc), vec3_add(vec3_scale(a, wa), vec3_scale(c, wc)));
}

struct sim_sight sim_rolling_sight(struct sim_rolling *rolling, const struct sim_scene *scene,
				   uint32_t camera, uint32_t marker, double *facing)
{
	struct sim_truth_marker *now = &rolling->at[1].markers[marker];
	const struct sim_truth_marker mid = *now, *first = &rolling->at[0].markers[marker],
				      *last = &rolling->at[2].markers[marker];
	struct sim_sight sight = {0};

	for (int step = 0; rolling->rolls && step < ROLLING_STEPS; step++) {
		if (!sim_camera_project(&scene->cameras[camera], now->p_stage_m, sight.pixel))
			break;
		double place = 2 * sight.pixel[1] / (rolling->row_count - 1) - 1;

		now->p_stage_m = between(first->p_stage_m, mid.p_stage_m, last->p_stage_m, place);
		now->normal_stage = vec3_unit(
			between(first->normal_stage, mid.normal_stage, last->normal_stage, place));
	}
	sight.seen = scene_camera_sees(scene, &rolling->at[1], camera, marker, sight.pixel, facing);
	return sight;
}

int sim_scene_sights(const struct sim_scene *scene, uint32_t camera, uint64_t shot,
		     struct sim_sight out[LABEL_MAX])
{
	struct sim_rolling *rolling = malloc(sizeof(*rolling));
	double facing;

	if (!rolling)
		return -ENOMEM;
	sim_rolling_init(rolling, scene, camera, shot);
	for (uint32_t m = 0; m < scene->layout.marker_count; m++)
		out[m] = sim_rolling_sight(rolling, scene, camera, m, &facing);
	free(rolling);
	return 0;
}

uint32_t sim_scene_board_sights(const struct sim_scene *scene, uint32_t camera, uint64_t shot,
				struct sim_board_corner out[BOARD_CORNER_MAX])
{
	struct exposure exposure = scene_exposure(scene, camera, shot);

	if (!scene->script.board)
		return 0;
	sim_board_corners(&scene->board, &scene->cameras[camera], &exposure, out);
	return (uint32_t)board_corner_count(&scene->board.print);
}
