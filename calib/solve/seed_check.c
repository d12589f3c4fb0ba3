/*
 * Observations that no solver can help.
 */
#include <errno.h>
#include <math.h>

#include "calib/solve/seed_parts.h"

#define SAME_PX 0.5 /* corners of two cameras in one place, apart */

int seed_check_views(const struct seed_work *work)
{
	const struct observations *o = work->observations;
	uint32_t count[CAMERA_MAX] = {0};
	int err = 0;

	for (uint32_t v = 0; v < o->view_count; v++)
		count[o->views[v].camera] += work->good[v];
	for (uint32_t c = 0; c < o->camera_count; c++)
		if (count[c] < SEED_VIEWS_MIN) {
			diag_add(work->diag,
				 "camera %s: %u usable views of the board, %d are needed; wave the "
				 "board where this camera sees it whole and sharp",
				 o->cameras[c].name, count[c], SEED_VIEWS_MIN);
			err = -EINVAL;
		}
	return err;
}

/* Mean distance of corners that two views share, or infinity. */
static double distance_px(const struct observations *o, uint32_t a, uint32_t b)
{
	const double(*pa)[2] = observations_px(o, a), (*pb)[2] = observations_px(o, b);
	double sum = 0;
	uint32_t count = 0;

	for (uint32_t i = 0; i < o->corner_count; i++) {
		double distance = hypot(pa[i][0] - pb[i][0], pa[i][1] - pb[i][1]);

		if (isnan(distance))
			continue;
		sum += distance;
		count++;
	}
	return count ? sum / count : INFINITY;
}

static bool see_the_same(const struct seed_work *work, uint32_t a, uint32_t b)
{
	uint32_t shared = 0;

	for (uint32_t n = 0; n < work->pose_count; n++) {
		uint32_t va = seed_view(work, n, a), vb = seed_view(work, n, b);

		if (va == NO_VIEW || vb == NO_VIEW)
			continue;
		if (distance_px(work->observations, va, vb) > SAME_PX)
			return false;
		shared++;
	}
	return shared >= SEED_LINKS_MIN;
}

int seed_check_duplicates(const struct seed_work *work)
{
	const struct observations *o = work->observations;
	int err = 0;

	for (uint32_t a = 0; a < o->camera_count; a++)
		for (uint32_t b = a + 1; b < o->camera_count; b++)
			if (see_the_same(work, a, b)) {
				diag_add(work->diag,
					 "cameras %s and %s: all their corners are in the same "
					 "places; one device under two names: correct an address",
					 o->cameras[a].name, o->cameras[b].name);
				err = -EINVAL;
			}
	return err;
}
