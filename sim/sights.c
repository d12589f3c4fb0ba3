/*
 * Sights of markers and corners.
 */
#include "sim/sights.h"

#include <errno.h>
#include <stdlib.h>

#include "sim/world/scene_parts.h"

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

struct sim_truth_occluder sim_rolling_occluder(const struct sim_rolling *rolling, uint32_t occluder,
					       double row)
{
	const struct sim_truth_occluder *first = &rolling->at[0].occluders[occluder],
					*last = &rolling->at[2].occluders[occluder];
	struct sim_truth_occluder now = rolling->at[1].occluders[occluder];
	double place = 2 * row / (rolling->row_count - 1) - 1;

	if (!rolling->rolls || occluder >= rolling->at[0].occluder_count ||
	    occluder >= rolling->at[2].occluder_count)
		return now; /* who has just come is drawn standing */
	now.centre_stage_m =
		between(first->centre_stage_m, now.centre_stage_m, last->centre_stage_m, place);
	for (int k = 0; k < 3; k++) {
		const double *a = first->to_unit[k], *b = last->to_unit[k];
		double *m = now.to_unit[k];
		struct vec3 row_now =
			between((struct vec3){a[0], a[1], a[2]}, (struct vec3){m[0], m[1], m[2]},
				(struct vec3){b[0], b[1], b[2]}, place);

		m[0] = row_now.x;
		m[1] = row_now.y;
		m[2] = row_now.z;
	}
	return now;
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
