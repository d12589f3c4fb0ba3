/*
 * How solved cameras see points of the reference frame, and where seen points are.
 */
#pragma once

#include <stdbool.h>

#include "base/geometry.h"
#include "calib/solve/solve.h"

/* Where a camera stands, in coordinates of camera 0. */
struct vec3 solution_centre_m(const struct solution *solution, uint32_t camera);

/* Projects a point. False: not in front of the camera. */
bool solution_project(const struct solution *solution, uint32_t camera, struct vec3 p_ref_m,
		      double px[2]);

/* Projects a point, with derivatives by the point (1/m), by the camera's rt_cam_ref, and, when
 * `by_lens` is not NULL, by its lens numbers [2][lens_count]. */
struct sight {
	double px[2];
	double by_point[2][3];
	double by_pose[2][6];
};
bool solution_sight(const struct solution *solution, uint32_t camera, struct vec3 p_ref_m,
		    struct sight *sight, double *by_lens);

/* The point that cameras of the mask see at px[camera], least squares in pixels from `start_m`.
 * Returns 0, or -EDOM when fewer than two do or their rays are parallel. */
int solution_triangulate(const struct solution *solution, uint32_t camera_mask,
			 const double (*px)[2], struct vec3 start_m, struct vec3 *p_ref_m);
