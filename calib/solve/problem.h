/*
 * A calibration as mrcal's arguments. The numbers that it changes lie in one block of shared
 * memory, so that a child process can do the work. Only calib/ includes this.
 */
#pragma once

#include <mrcal/mrcal.h>

#include "calib/solve/solve.h"

struct problem {
	mrcal_lensmodel_t lens;
	int lens_count, camera_count, frame_count, view_count;
	int width, height, corner_count; /* of the board, in corners */
	double square_m;
	mrcal_problem_selections_t selections; /* of the last stage */
	/* in the block */
	double *intrinsics;           /* [camera][lens_count] */
	mrcal_pose_t *extrinsics;     /* [camera - 1]: rt_cam_ref */
	mrcal_pose_t *frames;         /* [frame]: rt_ref_board */
	mrcal_calobject_warp_t *warp; /* [1] */
	mrcal_point3_t *pool;         /* [view][corner]: pixels and weight; < 0: not to be used */
	double *residuals;            /* measurement_count */
	double *rms_px;               /* [1]; < 0: the library failed */
	void *block;
	size_t block_bytes;
	size_t residual_count; /* room for it */
	/* owned */
	mrcal_observation_board_t *views; /* by frame, then camera */
	int *sizes_px;                    /* [camera][2] */
	uint32_t *view_of;                /* of the observations */
	uint32_t *nth_of;                 /* [frame]: nth pose of the observations */
};

/* False for a lens that mrcal does not know or cannot solve for. */
bool problem_find_lens(mrcal_lensmodel_t *lens, const char *name);

/* `used` says which views take part; NULL: all. Returns 0, -ENOMEM, or -EINVAL for a lens that
 * mrcal does not know or cannot solve for.
 */
int problem_init(struct problem *problem, const struct observations *observations, const bool *used,
		 const char *lens);

/* Of the views that a solution was made from, with the selections of its last stage; its numbers
 * come with problem_set(). Returns 0 or a negative errno. */
int problem_init_solved(struct problem *problem, const struct observations *observations,
			const struct solution *solution);
void problem_finish(struct problem *problem); /* zeroed is fine */

/* Takes lenses, cameras, poses and warp from a solution of the same observations, and leaves out
 * the corners that it refused. */
void problem_set(struct problem *problem, const struct solution *solution);

/* What a calibration finally optimises. A splined lens holds its core: the spline has it, too. */
mrcal_problem_selections_t problem_last_selections(const struct problem *problem);

/* Runs mrcal_optimize(); the result is in the block. */
void problem_optimise(struct problem *problem, mrcal_problem_selections_t selections);

int problem_measurement_count(const struct problem *problem);
int problem_state_count(const struct problem *problem);

int problem_entry_room(const struct problem *problem); /* for the Jacobian: it has no more */

/* Real units of each packed number of the state. Spoils the block's numbers: set them anew. Returns
 * 0 or -EDOM. */
int problem_scales(struct problem *problem, double *scales);

/* mrcal_optimizer_callback() at the block's numbers, for the last stage's selections: residuals
 * into the block, the packed state, and, when `jt` is not NULL, the Jacobian. Returns 0 or -EDOM.
 */
int problem_evaluate(struct problem *problem, double *packed, struct cholmod_sparse_struct *jt);

/* Of the problem's last stage, solved; `seed` has the poses that no good view shows. Returns 0 or
 * -ENOMEM. */
int solution_read(struct solution *solution, struct problem *problem,
		  const struct observations *observations, const struct seed *seed);
