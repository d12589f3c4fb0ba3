/*
 * Homography by linear least squares.
 */
#include "calib/board/homography.h"

#include <errno.h>
#include <math.h>
#include <string.h>

#include "calib/solve/small_solve.h"

#define PAIRS_MIN 4

/* Takes places to mean 0 and mean distance sqrt(2): p' = (p - centre) * scale. */
struct norming {
	double centre[2], scale;
};

static bool pair_is_there(const double *from, const double *to)
{
	return !isnan(from[0] + from[1] + to[0] + to[1]);
}

static uint32_t norm_both(struct norming norming[2], const double (*from)[2], const double (*to)[2],
			  uint32_t count)
{
	uint32_t there = 0;

	memset(norming, 0, 2 * sizeof(*norming));
	for (uint32_t i = 0; i < count; i++) {
		if (!pair_is_there(from[i], to[i]))
			continue;
		there++;
		for (int k = 0; k < 2; k++) {
			norming[0].centre[k] += (from[i][k] - norming[0].centre[k]) / there;
			norming[1].centre[k] += (to[i][k] - norming[1].centre[k]) / there;
		}
	}
	for (uint32_t i = 0; i < count; i++) {
		if (!pair_is_there(from[i], to[i]))
			continue;
		norming[0].scale +=
			hypot(from[i][0] - norming[0].centre[0], from[i][1] - norming[0].centre[1]);
		norming[1].scale +=
			hypot(to[i][0] - norming[1].centre[0], to[i][1] - norming[1].centre[1]);
	}
	for (int k = 0; k < 2; k++)
		norming[k].scale = M_SQRT2 * there / norming[k].scale;
	return there;
}

static void add_pair(double a[64], double b[8], const struct norming norming[2],
		     const double from[2], const double to[2])
{
	double x = (from[0] - norming[0].centre[0]) * norming[0].scale;
	double y = (from[1] - norming[0].centre[1]) * norming[0].scale;
	double u = (to[0] - norming[1].centre[0]) * norming[1].scale;
	double v = (to[1] - norming[1].centre[1]) * norming[1].scale;

	small_solve_add(8, a, b, (double[8]){x, y, 1, 0, 0, 0, -u * x, -u * y}, u, 1);
	small_solve_add(8, a, b, (double[8]){0, 0, 0, x, y, 1, -v * x, -v * y}, v, 1);
}

/* h = to^-1 n from, for norming `to` and `from`. */
static void undo_norming(double h[9], const double n[9], const struct norming norming[2])
{
	const struct norming *from = &norming[0], *to = &norming[1];
	double m[9];

	for (int r = 0; r < 3; r++) {
		m[r * 3] = n[r * 3] * from->scale;
		m[r * 3 + 1] = n[r * 3 + 1] * from->scale;
		m[r * 3 + 2] =
			n[r * 3 + 2] - m[r * 3] * from->centre[0] - m[r * 3 + 1] * from->centre[1];
	}
	for (int c = 0; c < 3; c++) {
		h[c] = m[c] / to->scale + to->centre[0] * m[6 + c];
		h[3 + c] = m[3 + c] / to->scale + to->centre[1] * m[6 + c];
		h[6 + c] = m[6 + c];
	}
}

int homography_fit(double h[9], const double (*from)[2], const double (*to)[2], uint32_t count)
{
	struct norming norming[2];
	double a[64] = {0}, n[9] = {[8] = 1};

	if (norm_both(norming, from, to, count) < PAIRS_MIN)
		return -EDOM;
	for (uint32_t i = 0; i < count; i++)
		if (pair_is_there(from[i], to[i]))
			add_pair(a, n, norming, from[i], to[i]);
	n[8] = 1;
	if (small_solve(8, a, n))
		return -EDOM;
	undo_norming(h, n, norming);
	return 0;
}

bool homography_apply(const double h[9], const double from[2], double to[2])
{
	double w = h[6] * from[0] + h[7] * from[1] + h[8];

	if (!(w > 0))
		return false;
	to[0] = (h[0] * from[0] + h[1] * from[1] + h[2]) / w;
	to[1] = (h[3] * from[0] + h[4] * from[1] + h[5]) / w;
	return true;
}
