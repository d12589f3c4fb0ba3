/*
 * The worst point of the volume in the images of those that see it.
 */
#include "calib/board/where_next.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "calib/board/coverage.h"
#include "calib/board/sight.h"

/* How far out a place is in an image: 0 in the middle, 1 at the border. */
static double outwards(const struct observed_camera *camera, const double px[2])
{
	return fmax(fabs(2 * (px[0] + 0.5) / camera->width_px - 1),
		    fabs(2 * (px[1] + 0.5) / camera->height_px - 1));
}

static void add_camera(struct where_next *where, const struct observations *o, uint32_t camera,
		       const double px[2], double range_m)
{
	double out = outwards(&o->cameras[camera], px);
	uint32_t at = 0;

	while (at < where->camera_count &&
	       outwards(&o->cameras[where->cameras[at].camera], where->cameras[at].px) >= out)
		at++;
	if (at == WHERE_CAMERAS)
		return;
	if (where->camera_count < WHERE_CAMERAS)
		where->camera_count++;
	for (uint32_t i = where->camera_count - 1; i > at; i--)
		where->cameras[i] = where->cameras[i - 1];
	where->cameras[at].camera = camera;
	where->cameras[at].range_m = range_m;
	memcpy(where->cameras[at].px, px, sizeof(where->cameras[at].px));
}

struct where_next where_next(const struct uncertainty *uncertainty, const struct volume *volume,
			     const struct solution *solution,
			     const struct observations *observations,
			     const struct pose *rt_stage_ref)
{
	struct vec3 p = volume->p_ref_m[uncertainty->worst];
	uint32_t mask = volume->camera_mask[uncertainty->worst];
	struct where_next where = {.p_stage_m = pose_apply(rt_stage_ref, p),
				   .sigma_m = uncertainty->worst_m,
				   .seen_by = (uint32_t)__builtin_popcount(mask)};

	for (; mask; mask &= mask - 1) {
		uint32_t camera = (uint32_t)__builtin_ctz(mask);
		double px[2];

		if (solution_project(solution, camera, p, px))
			add_camera(&where, observations, camera, px,
				   vec3_distance(p, solution_centre_m(solution, camera)));
	}
	return where;
}

void where_next_words(const struct where_next *where, const struct observations *observations,
		      char words[WHERE_WORDS_BYTES])
{
	const struct vec3 *p = &where->p_stage_m;
	int used = snprintf(words, WHERE_WORDS_BYTES,
			    "%.3g mm at (%.2f, %.2f, %.2f) m, seen by %u cameras",
			    1e3 * where->sigma_m, p->x, p->y, p->z, where->seen_by);

	for (uint32_t i = 0; i < where->camera_count && used < WHERE_WORDS_BYTES; i++) {
		const struct observed_camera *camera =
			&observations->cameras[where->cameras[i].camera];

		used += snprintf(words + used, WHERE_WORDS_BYTES - (size_t)used,
				 "%s%s of %.64s's image, %.1f m away", i ? "; " : ": ",
				 coverage_region_name(camera, where->cameras[i].px), camera->name,
				 where->cameras[i].range_m);
	}
}
