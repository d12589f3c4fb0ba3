/*
 * Which spot is whose, also in a camera that was bumped: its pictures are shifted as a whole, and
 * the shift is what most pairs of a spot and a marker's place agree on.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calib/rig/refine_parts.h"

#define SIDE 81 /* bins of a pixel: REFINE_OFF_MAX_PX to all sides */
#define NEAR_PX 1.2
#define ALONE_PX 2.4    /* no other spot as near */
#define TAKEN_SHARE 0.8 /* of its spots: a camera of which the tracker left more out is doubted */

struct votes {
	uint32_t bins[SIDE][SIDE];
};

/* The spots of one camera in one shot. */
struct spot_range {
	const struct seen_spot *first;
	uint32_t count;
};

static struct spot_range range_of(const struct marker_shots *shots, uint32_t *at, uint32_t shot,
				  uint32_t camera)
{
	struct spot_range range;

	while (*at < shots->spot_count &&
	       (shots->spots[*at].shot < shot ||
		(shots->spots[*at].shot == shot && shots->spots[*at].camera < camera)))
		(*at)++;
	range = (struct spot_range){&shots->spots[*at], 0};
	for (uint32_t i = *at; i < shots->spot_count && shots->spots[i].shot == shot &&
			       shots->spots[i].camera == camera;
	     i++)
		range.count++;
	return range;
}

/* What is seen by three cameras is a marker even when it has no name. */
static bool is_wanted(const struct seen_point *point, bool named_only)
{
	return point->label >= 0 || (!named_only && __builtin_popcount(point->camera_mask) >= 3);
}

static void vote(struct votes *votes, const struct spot_range *range, const double pixel[2])
{
	for (uint32_t s = 0; s < range->count; s++) {
		int x = (int)lround(range->first[s].px[0] - pixel[0]) + SIDE / 2;
		int y = (int)lround(range->first[s].px[1] - pixel[1]) + SIDE / 2;

		if (x >= 0 && x < SIDE && y >= 0 && y < SIDE)
			votes->bins[y][x]++;
	}
}

/* The middle of the fullest three by three bins; the nearest such to no shift at all. */
static void find_peak(const struct votes *votes, double shift_px[2])
{
	double most = 0;

	for (int y = 1; y < SIDE - 1; y++)
		for (int x = 1; x < SIDE - 1; x++) {
			double sum = 0, sum_x = 0, sum_y = 0;

			for (int i = 0; i < 9; i++) {
				int u = x + i % 3 - 1, v = y + i / 3 - 1;

				sum += votes->bins[v][u];
				sum_x += (double)votes->bins[v][u] * (u - SIDE / 2);
				sum_y += (double)votes->bins[v][u] * (v - SIDE / 2);
			}
			if (sum > most) {
				most = sum;
				shift_px[0] = sum_x / sum;
				shift_px[1] = sum_y / sum;
			}
		}
}

static void find_shift(const struct view *view, uint32_t camera, const struct marker_shots *shots,
		       struct votes *votes, bool named_only, double shift_px[2])
{
	uint32_t at = 0;

	memset(votes, 0, sizeof(*votes));
	shift_px[0] = shift_px[1] = 0;
	for (uint32_t p = 0; p < shots->point_count; p++) {
		const struct seen_point *point = &shots->points[p];
		double pixel[2];

		if (!is_wanted(point, named_only) ||
		    !view_project(view, point->p_stage_m, pixel, NULL))
			continue;
		struct spot_range range = range_of(shots, &at, point->shot, camera);
		vote(votes, &range, pixel);
	}
	find_peak(votes, shift_px);
}

/* The only spot there, or NULL. */
static const struct seen_spot *find_spot(const struct spot_range *range, const double pixel[2])
{
	const struct seen_spot *found = NULL;
	int count = 0;

	for (uint32_t s = 0; s < range->count; s++) {
		double away_px =
			hypot(range->first[s].px[0] - pixel[0], range->first[s].px[1] - pixel[1]);

		count += away_px < ALONE_PX;
		if (away_px < NEAR_PX)
			found = &range->first[s];
	}
	return count == 1 ? found : NULL;
}

/* For each point the camera's spot, or NULL. */
static void match_camera(const struct view *view, uint32_t camera, const struct marker_shots *shots,
			 const double shift_px[2], bool named_only, const struct seen_spot **found)
{
	uint32_t at = 0, taken = 0, count = 0;

	for (uint32_t p = 0; p < shots->point_count; p++) {
		const struct seen_point *point = &shots->points[p];
		double pixel[2];

		found[p] = NULL;
		if (!is_wanted(point, named_only) ||
		    !view_project(view, point->p_stage_m, pixel, NULL))
			continue;
		struct spot_range range = range_of(shots, &at, point->shot, camera);
		pixel[0] += shift_px[0];
		pixel[1] += shift_px[1];
		found[p] = find_spot(&range, pixel);
		count += found[p] != NULL;
		taken += found[p] && point->camera_mask >> camera & 1;
	}
	if (taken < TAKEN_SHARE * count)
		return;
	for (uint32_t p = 0; p < shots->point_count; p++) /* more likely another marker's */
		if (!(shots->points[p].camera_mask >> camera & 1))
			found[p] = NULL;
}

static void add_point(struct refine_problem *problem, const struct seen_point *point,
		      const struct seen_spot *const *found, uint32_t stride)
{
	struct refine_point *to = &problem->points[problem->point_count];

	*to = (struct refine_point){.shot = point->shot,
				    .label = point->label,
				    .p_stage_m = point->p_stage_m,
				    .first_view = problem->view_count};
	for (uint32_t c = 0; c < problem->camera_count; c++) {
		const struct seen_spot *spot = found[c * stride];

		if (spot)
			problem->views[to->first_view + to->view_count++] =
				(struct refine_view){.camera = c,
						     .px = {spot->px[0], spot->px[1]},
						     .sigma_px = spot->sigma_px};
	}
	if (to->view_count < 3)
		return;
	problem->view_count += to->view_count;
	problem->point_count++;
}

static void begin(struct refine_problem *problem, const struct rig *rig)
{
	memset(problem, 0, sizeof(*problem));
	problem->camera_count = rig->camera_count;
	for (uint32_t c = 0; c < rig->camera_count; c++) {
		problem->cameras[c] = rig->views[c];
		problem->centre_m[c] = rig->views[c].centre_stage_m;
	}
}

int refine_match(struct refine_problem *problem, const struct rig *rig,
		 const struct marker_shots *shots, bool named_only)
{
	size_t points = shots->point_count ? shots->point_count : 1;
	const struct seen_spot **found = calloc(points * rig->camera_count, sizeof(*found));
	struct votes *votes = malloc(sizeof(*votes));

	begin(problem, rig);
	problem->points = calloc(points, sizeof(*problem->points));
	problem->views = calloc(points * rig->camera_count, sizeof(*problem->views));
	bool good = found && votes && problem->points && problem->views;
	for (uint32_t c = 0; good && c < rig->camera_count; c++) {
		double shift_px[2];

		find_shift(&rig->views[c], c, shots, votes, named_only, shift_px);
		match_camera(&rig->views[c], c, shots, shift_px, named_only, found + c * points);
	}
	for (uint32_t p = 0; good && p < shots->point_count; p++)
		if (is_wanted(&shots->points[p], named_only))
			add_point(problem, &shots->points[p], found + p, (uint32_t)points);
	free(found);
	free(votes);
	if (!good)
		refine_problem_finish(problem);
	return good ? 0 : -ENOMEM;
}

void refine_problem_finish(struct refine_problem *problem)
{
	free(problem->points);
	free(problem->views);
	problem->points = NULL;
	problem->views = NULL;
}
