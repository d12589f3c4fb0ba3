/*
 * Distances between cameras, now over before.
 */
#include "calib/solve/scale_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/sort.h"
#include "calib/board/sight.h"

#define CAMERAS_MIN 3
#define CHANGE_MIN 0.003
#define ALIKE 0.3       /* of the change: how far a pair may be from the median */
#define ALIKE_SHARE 0.8 /* of the pairs */
#define DISTANCE_MIN_M 0.05

struct moved {
	struct vec3 now_m, before_m;
};

static uint32_t find_common(const struct observations *o, const struct solution *solution,
			    const struct rig *before, struct moved *moved)
{
	uint32_t count = 0;

	for (uint32_t c = 0; c < o->camera_count; c++)
		for (uint32_t b = 0; b < before->camera_count; b++)
			if (!strcmp(o->cameras[c].name, before->names[b]))
				moved[count++] = (struct moved){solution_centre_m(solution, c),
								before->views[b].centre_stage_m};
	return count;
}

static uint32_t find_ratios(const struct moved *moved, uint32_t count, double *ratios)
{
	uint32_t pairs = 0;

	for (uint32_t a = 0; a < count; a++)
		for (uint32_t b = a + 1; b < count; b++) {
			double before_m = vec3_distance(moved[a].before_m, moved[b].before_m);

			if (before_m > DISTANCE_MIN_M)
				ratios[pairs++] =
					vec3_distance(moved[a].now_m, moved[b].now_m) / before_m;
		}
	return pairs;
}

bool scale_has_changed(const struct observations *observations, const struct solution *solution,
		       const struct rig *before, double *factor, struct diag *diag)
{
	double ratios[CAMERA_MAX * CAMERA_MAX / 2];
	struct moved moved[CAMERA_MAX];
	uint32_t count = find_common(observations, solution, before, moved), alike = 0;
	uint32_t pairs = find_ratios(moved, count, ratios);

	if (count < CAMERAS_MIN || pairs < CAMERAS_MIN)
		return false;
	sort_doubles(ratios, pairs);
	double median = ratios[pairs / 2];
	for (uint32_t i = 0; i < pairs; i++)
		alike += fabs(ratios[i] - median) < ALIKE * fabs(median - 1);
	if (fabs(median - 1) < CHANGE_MIN || alike < ALIKE_SHARE * pairs)
		return false;
	diag_add(diag,
		 "all distances between cameras are %.4f times those of the rig before; either the "
		 "board's squares are not %.2f mm (%.2f mm would explain it) or those of that rig "
		 "were not: measure the print's rulers",
		 median, 1e3 * observations->board.square_m,
		 1e3 * observations->board.square_m / median);
	*factor = median;
	return true;
}
