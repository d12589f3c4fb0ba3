/*
 * A board that is waved before simulated cameras, and the corners that they see of it: truth for
 * the tests of calibration.
 */
#pragma once

#include "base/rng.h"
#include "calib/board/observations.h"
#include "calib/board/sight.h"
#include "calib/solve/solve.h"
#include "calib/solve/volume.h"
#include "sim/cameras.h"

struct wave {
	uint32_t ir_count, hd_count;
	uint32_t pose_count;
	struct board board;
	double noise_px;
	double lost_part;    /* of the corners, at random */
	double stretch;      /* of the print's height; 0: none */
	uint64_t seed;       /* of cameras and poses */
	uint64_t noise_seed; /* of the corners' noise */
};

struct waved {
	uint32_t camera_count;
	struct sim_camera cameras[SIM_DEVICE_MAX];
	struct pose *rt_stage_board; /* owned; per pose */
	struct observations observations;
};

void wave_make(struct waved *waved, const struct wave *wave);
void wave_finish(struct waved *waved);

#define WAVE_VOLUME_POINTS 125                 /* a box of 0.4 m before the cameras */
struct vec3 wave_volume_point(uint32_t index); /* stage coordinates */

/* How far a solution is from the truth, rigidly aligned: by camera centres for the first, by the
 * volume's points for the others. */
struct wave_errors {
	double camera_worst_mm;
	double volume_px;      /* rms of projected points */
	double triangulate_mm; /* mean, from the noise-free pixels of two cameras 1/3 of the arc
				  apart */
};
struct wave_errors wave_judge(const struct waved *waved, const struct solution *solution);

/* The place that the solution gives to what is at `p_stage_m`, by the noise-free pixels of the
 * cameras in the mask; in coordinates of its reference. False: fewer than two see it. */
bool wave_triangulate(const struct waved *waved, const struct solution *solution,
		      uint32_t camera_mask, struct vec3 p_stage_m, struct vec3 *p_ref_m);

/* The volume's points as the solution has them, and how far each is off, rigidly aligned, in the
 * axes of its reference. */
void wave_volume(const struct waved *waved, const struct solution *solution, struct volume *volume,
		 struct vec3 off_m[VOLUME_POINT_MAX]);

/* Seeds and solves with default settings. Returns 0 or a negative errno. */
int wave_solve(const struct waved *waved, struct solution *solution, struct seed *seed);
