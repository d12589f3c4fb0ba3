/*
 * Between triangulate.c and view_doubt.c: the equations of one point, and symmetric 3x3 matrices,
 * stored as xx xy xz yy yz zz.
 */
#pragma once

#include <stdbool.h>

#include "track/match/triangulate.h"

/* One view's error and its derivative at the point where it was taken. */
struct equation {
	double e[2];         /* pixel seen minus pixel projected */
	struct projection q; /* of the point */
	double weight;       /* 1 / sigma^2 */
};

/* False when the matrix is as good as singular. */
static inline bool sym3_invert(const double a[6], double inv[6], double *determinant)
{
	double c0 = a[3] * a[5] - a[4] * a[4];
	double c1 = a[2] * a[4] - a[1] * a[5];
	double c2 = a[1] * a[4] - a[2] * a[3];
	double det = a[0] * c0 + a[1] * c1 + a[2] * c2;

	if (!(fabs(det) > 1e-12 * fabs(a[0] * a[3] * a[5])))
		return false;
	double scale = 1 / det;
	inv[0] = c0 * scale;
	inv[1] = c1 * scale;
	inv[2] = c2 * scale;
	inv[3] = (a[0] * a[5] - a[2] * a[2]) * scale;
	inv[4] = (a[1] * a[2] - a[0] * a[4]) * scale;
	inv[5] = (a[0] * a[3] - a[1] * a[1]) * scale;
	*determinant = det;
	return true;
}

static inline struct vec3 sym3_apply(const double a[6], struct vec3 v)
{
	return (struct vec3){a[0] * v.x + a[1] * v.y + a[2] * v.z,
			     a[1] * v.x + a[3] * v.y + a[4] * v.z,
			     a[2] * v.x + a[4] * v.y + a[5] * v.z};
}

/* sum += scale * a */
static inline void sym3_add(double sum[6], const double a[6], double scale)
{
	for (int k = 0; k < 6; k++)
		sum[k] += scale * a[k];
}

/* Squared distance in the image that a step of the point leaves of a view's error. */
static inline double equation_left_px2(const struct equation *q, struct vec3 step)
{
	const double(*j)[3] = q->q.slopes;
	double x = q->e[0] - (j[0][0] * step.x + j[0][1] * step.y + j[0][2] * step.z);
	double y = q->e[1] - (j[1][0] * step.x + j[1][1] * step.y + j[1][2] * step.z);

	return x * x + y * y;
}

/* What the views say together when some of them may lie. */
struct doubt {
	struct vec3 step; /* from where the equations were taken */
	double cov_m2[6];
	uint32_t bad_mask; /* views that more probably lie than not */
};

/* Returns 0 or -EDOM. */
int doubt_views(const struct sighting *sightings, const struct equation *equations, int count,
		struct doubt *out);
