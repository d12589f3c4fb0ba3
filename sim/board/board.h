/*
 * A calibration board that somebody waves through the volume: where it is at any time, and where a
 * camera sees each of its corners. The same truth for renderers and for whoever judges a
 * calibration.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "config/board.h"
#include "sim/cameras.h"

#define BOARD_WAVES 3 /* sines per axis */

struct board_wave {
	double amplitude[BOARD_WAVES], hz[BOARD_WAVES], phase_rad[BOARD_WAVES];
};

/* Flat; read by any thread once made. */
struct sim_board {
	struct board print;
	double margin_m; /* white, around the checkerboard */
	struct vec3 middle_m;
	double spin_hz; /* about the vertical, so that cameras all around see it in turn */
	struct board_wave place[3], tilt[3];
};

/* When a camera exposed which row, in scene time. */
struct exposure {
	double mid_s; /* of the middle row */
	double row_s; /* from row to row; 0: global shutter */
	double length_s;
};

static inline double exposure_of_row_s(const struct exposure *exposure, double row, int height_px)
{
	return exposure->mid_s + exposure->row_s * (row - 0.5 * (height_px - 1));
}

/* A board that fits the placement (enum sim_placement): 12 x 9 squares of 35 mm before a face's
 * cameras, BOARD_DEFAULT's in a room. Its warp and its path vary with the seed. */
void sim_board_init(struct sim_board *board, int placement, uint64_t seed);

/* By somebody who reaches for the borders of the images, where much of the board is out of them. */
void sim_board_reach(struct sim_board *board);

/* rt_stage_board; the middle of the print is what is waved about. */
struct pose sim_board_pose(const struct sim_board *board, double time_s);

/* Does the camera look at the board's printed side? */
bool sim_board_faces(const struct pose *rt_stage_board, const struct sim_camera *camera);

struct sim_board_corner {
	bool seen; /* within the image, from the printed side */
	double pixel[2];
};

/* The truth of every corner, at the time at which the camera exposes the row it falls on. `out` has
 * room for board_corner_count(). */
void sim_board_corners(const struct sim_board *board, const struct sim_camera *camera,
		       const struct exposure *exposure, struct sim_board_corner *out);
