/*
 * Where a camera's picture of a shot has every marker and every corner of the board: for those who
 * draw over the picture or measure it.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "sim/board/board.h"
#include "sim/world/scene.h"

struct sim_sight {
	bool seen; /* unobstructed and within the image */
	double pixel[2];
};

/* The scene at the first, the middle and the last row of a picture; all the same with a global
 * shutter. In between, places are interpolated by parabolas. */
struct sim_rolling {
	int row_count;
	bool rolls;
	struct sim_truth at[3];
};

/* `camera` counts from the first IR camera, HD behind them. Do not allocate. */
void sim_rolling_init(struct sim_rolling *rolling, const struct sim_scene *scene, uint32_t camera,
		      uint64_t shot);

/* Marker `marker` as the camera exposes it, on whatever row it falls: its place is put into
 * at[1]. With `facing` the cosine of the angle to the camera. */
struct sim_sight sim_rolling_sight(struct sim_rolling *rolling, const struct sim_scene *scene,
				   uint32_t camera, uint32_t marker, double *facing);

/* An occluder at the time of a row. */
struct sim_truth_occluder sim_rolling_occluder(const struct sim_rolling *rolling, uint32_t occluder,
					       double row);

/* One for every marker of the layout. Returns 0 or -ENOMEM. */
int sim_scene_sights(const struct sim_scene *scene, uint32_t camera, uint64_t shot,
		     struct sim_sight out[LABEL_MAX]);

/* One for every corner of the board; returns how many, 0 in a scene without a board. */
uint32_t sim_scene_board_sights(const struct sim_scene *scene, uint32_t camera, uint64_t shot,
				struct sim_board_corner out[BOARD_CORNER_MAX]);
