/*
 * The calibration itself: lenses, cameras, board poses and the board's warp, all at once, by mrcal
 * (https://mrcal.secretsauce.net), from a seed. The reference frame is camera 0's.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "calib/board/observations.h"
#include "calib/solve/seed.h"

#define SOLVE_LENS_BYTES 96
#define SOLVE_LENS_DEFAULT "LENSMODEL_OPENCV8"

struct solve_settings {
	const char *lens;   /* as mrcal calls it; one for all cameras */
	double seconds_max; /* then it is given up */
};

#define SOLVE_SETTINGS_DEFAULT ((struct solve_settings){SOLVE_LENS_DEFAULT, 120})

/* Poses are rotation vector and translation, mrcal's rt. */
struct solution {
	char lens[SOLVE_LENS_BYTES];
	uint32_t lens_count; /* numbers of a lens */
	uint32_t camera_count, pose_count, view_count, corner_count;
	/* owned; shapes in square brackets */
	double *intrinsics;        /* [camera][lens_count] */
	double (*rt_cam_ref)[6];   /* [camera]; camera 0: zero */
	double (*rt_ref_board)[6]; /* [nth pose of the observations] */
	double (*residual_px)[2];  /* [view][corner], projected less seen; NaN: not used */

	double warp_m[2];    /* of the board: warp_x_m, warp_y_m */
	double rms_px;       /* of the distance, over all corners used */
	double mrcal_rms_px; /* as mrcal counts: per coordinate, unseen corners in the denominator
			      */
	double rms_camera_px[CAMERA_MAX];
	uint32_t used_count;    /* corners */
	uint32_t outlier_count; /* corners that were refused */
	double sigma_px;        /* noise of one coordinate, degrees of freedom allowed for */
};

/* Before there is anything to solve. Returns 0, or -EINVAL with a message. */
int solve_check_lens(const char *name, struct diag *diag);

/* Solves in a child process, so that it ends in time whatever the library does. Returns 0,
 * -ETIMEDOUT, -EINVAL when nothing fits (with messages), or another negative errno. */
int solve(struct solution *solution, const struct observations *observations,
	  const struct seed *seed, const struct solve_settings *settings, struct diag *diag);

void solution_finish(struct solution *solution); /* zeroed is fine */
