/*
 * A grid of points, and two calibrations compared on it.
 */
#include "calib/solve/volume.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

#include "base/sort.h"
#include "calib/board/sight.h"
#include "calib/rt.h"

#define POINTS_MIN 4
#define TAIL 0.05 /* of the board's places, left out at each side */

static uint32_t cameras_at(const struct solution *solution, const struct observations *observations,
			   struct vec3 p_ref_m)
{
	uint32_t mask = 0;

	for (uint32_t c = 0; c < solution->camera_count; c++) {
		const struct observed_camera *camera = &observations->cameras[c];
		double px[2];

		if (solution_project(solution, c, p_ref_m, px) && px[0] >= 0 && px[1] >= 0 &&
		    px[0] <= camera->width_px - 1 && px[1] <= camera->height_px - 1)
			mask |= 1U << c;
	}
	return mask;
}

static double along(double low, double high, int step)
{
	return low + (high - low) * step / (VOLUME_SIDE - 1);
}

static int take_box(struct volume *volume, const struct solution *solution,
		    const struct observations *observations, struct vec3 low_m, struct vec3 high_m)
{
	uint32_t count = 0;

	for (int i = 0; i < VOLUME_POINT_MAX; i++) {
		struct vec3 p = {along(low_m.x, high_m.x, i % VOLUME_SIDE),
				 along(low_m.y, high_m.y, i / VOLUME_SIDE % VOLUME_SIDE),
				 along(low_m.z, high_m.z, i / (VOLUME_SIDE * VOLUME_SIDE))};
		uint32_t mask = cameras_at(solution, observations, p);

		if (__builtin_popcount(mask) < 2)
			continue;
		volume->p_ref_m[count] = p;
		volume->camera_mask[count++] = mask;
	}
	volume->count = count;
	return count < POINTS_MIN ? -EDOM : 0;
}

static void trim(double *values, uint32_t count, double *low, double *high)
{
	uint32_t tail = (uint32_t)(TAIL * count);

	sort_doubles(values, count);
	*low = values[tail];
	*high = values[count - 1 - tail];
}

int volume_of_poses(struct volume *volume, const struct solution *solution,
		    const struct observations *observations)
{
	const struct board *board = &observations->board;
	uint32_t count = solution->pose_count;
	double *axes = malloc(3 * (size_t)count * sizeof(*axes));
	struct vec3 low, high;

	if (!axes || !count) {
		free(axes);
		return axes ? -EDOM : -ENOMEM;
	}
	struct vec3 middle =
		board_point_m(board, board->square_m * (board_corners_x(board) - 1) / 2,
			      board->square_m * (board_corners_y(board) - 1) / 2);
	for (uint32_t n = 0; n < count; n++) {
		struct pose rt_ref_board = pose_from_rt(solution->rt_ref_board[n]);
		struct vec3 p = pose_apply(&rt_ref_board, middle);

		axes[n] = p.x;
		axes[count + n] = p.y;
		axes[2 * count + n] = p.z;
	}
	trim(axes, count, &low.x, &high.x);
	trim(axes + count, count, &low.y, &high.y);
	trim(axes + 2 * count, count, &low.z, &high.z);
	free(axes);
	return take_box(volume, solution, observations, low, high);
}

/* Where `other` has what `solution` sees at a point. */
static int see_again(const struct volume *volume, uint32_t i, const struct solution *solution,
		     const struct solution *other, struct vec3 *p_m)
{
	double px[CAMERA_MAX][2];

	for (uint32_t c = 0; c < solution->camera_count; c++)
		if ((volume->camera_mask[i] & 1U << c) &&
		    !solution_project(solution, c, volume->p_ref_m[i], px[c]))
			return -EDOM;
	return solution_triangulate(other, volume->camera_mask[i], (const double(*)[2])px,
				    volume->p_ref_m[i], p_m);
}

int volume_difference(const struct volume *volume, const struct solution *solution,
		      const struct solution *other, double *rms_m)
{
	struct rigid_pair pairs[VOLUME_POINT_MAX];
	struct pose fit;
	double sum = 0;

	for (uint32_t i = 0; i < volume->count; i++) {
		pairs[i] = (struct rigid_pair){.to = volume->p_ref_m[i], .weight = 1};
		if (see_again(volume, i, solution, other, &pairs[i].from))
			return -EDOM;
	}
	if (rigid_fit(pairs, (int)volume->count, &fit))
		return -EDOM;
	for (uint32_t i = 0; i < volume->count; i++)
		sum += pow(rigid_error(&pairs[i], &fit), 2);
	*rms_m = sqrt(sum / volume->count);
	return 0;
}
