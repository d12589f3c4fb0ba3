/*
 * What the files of the refinement share.
 */
#pragma once

#include "calib/rig/refine.h"

#define REFINE_DOF 6 /* turn about the centre, then its shift; stage axes */

/* One camera's view of one point. */
struct refine_view {
	uint32_t camera;
	double px[2], sigma_px;
	double off_px[2]; /* spot - projection, as of the last pass */
};

struct refine_point {
	uint32_t shot;
	int label; /* LABEL_NONE: without a name */
	struct vec3 p_stage_m;
	uint32_t first_view, view_count;
};

/* Views stand in the order of their points. */
struct refine_problem {
	uint32_t camera_count, point_count, view_count;
	struct refine_point *points;
	struct refine_view *views;
	struct view cameras[CAMERA_MAX];  /* their tables are the rig's */
	struct vec3 centre_m[CAMERA_MAX]; /* by the rig */
	double scale_px[CAMERA_MAX];      /* what is far beyond it counts little */
	int half;                         /* 1, 2: of every other shot; 0: all */
};

/* By camera, all points taken out. */
struct refine_normal {
	double block[CAMERA_MAX][REFINE_DOF][REFINE_DOF], pull[CAMERA_MAX][REFINE_DOF];
	double reach[CAMERA_MAX][REFINE_DOF][REFINE_DOF]; /* of its pictures alone, px2 */
	double left_px2[CAMERA_MAX], weight[CAMERA_MAX];
	uint32_t view_count[CAMERA_MAX];
	uint32_t free_count, free_cameras[CAMERA_MAX];
	double *cross; /* of the free cameras, whole matrix; NULL when none is free */
};

/* Says which spot is whose; `named_only`: of markers that have a name. Returns 0 or -ENOMEM. */
int refine_match(struct refine_problem *problem, const struct rig *rig,
		 const struct marker_shots *shots, bool named_only);
void refine_problem_finish(struct refine_problem *problem);

/* Points to where their views want them, then the equations of all cameras there. The normal's
 * free cameras are set by the caller. */
void refine_pass(struct refine_problem *problem, struct refine_normal *normal);

/* Solves for the free cameras until they stand still. Returns 0, -ENOMEM or -EDOM. */
int refine_solve(struct refine_problem *problem, struct refine_normal *normal);

/* What one camera's step would be, how much it explains, and how far it moves its pictures. 0 when
 * it cannot be told. */
double refine_explain(const struct refine_normal *normal, uint32_t camera, double step[REFINE_DOF],
		      double *off_px);
