/*
 * Markers between two shots.
 */
#include <errno.h>
#include <math.h>

#include "protocol/stage_client.h"

int stage_interpolate(const int64_t times_ns[4], const double p_m[4][3], int64_t at_ns,
		      double out_m[3])
{
	double sum[3] = {0};

	if (at_ns < times_ns[0] || at_ns > times_ns[3])
		return -EDOM;
	for (int i = 0; i < 4; i++) {
		double weight = 1;

		for (int k = 0; k < 4; k++) {
			if (k == i)
				continue;
			if (times_ns[i] == times_ns[k])
				return -EDOM;
			weight *=
				(double)(at_ns - times_ns[k]) / (double)(times_ns[i] - times_ns[k]);
		}
		for (int axis = 0; axis < 3; axis++)
			sum[axis] += weight * p_m[i][axis];
	}
	for (int axis = 0; axis < 3; axis++)
		if (!isfinite(sum[axis]))
			return -EDOM;
	for (int axis = 0; axis < 3; axis++)
		out_m[axis] = sum[axis];
	return 0;
}
