/*
 * A counting sort of the blobs into strips across x: what is looked for is a few pixels wide, so
 * few others are in its strips.
 */
#include "track/match/sight_index.h"

#include <string.h>

static int strip_of(const struct sight_index *index, double x_px)
{
	int strip = (int)(x_px * index->strips_per_px);

	return strip < 0 ? 0 : strip < SIGHT_STRIP_COUNT ? strip : SIGHT_STRIP_COUNT - 1;
}

static double pixels_per_radian(const struct view *view)
{
	double middle[2] = {view->width_px * 0.5, view->height_px * 0.5};
	double beside[2] = {middle[0] + 1, middle[1]};

	return 1.0 / vec3_distance(view_ray(view, middle), view_ray(view, beside));
}

static void sort_into_strips(struct sight_index *index)
{
	uint16_t *from = index->strip_from, next[SIGHT_STRIP_COUNT];

	memset(from, 0, sizeof(index->strip_from));
	for (int i = 0; i < index->blob_count; i++)
		from[strip_of(index, index->blobs[i].x_px) + 1]++;
	for (int strip = 0; strip < SIGHT_STRIP_COUNT; strip++) {
		next[strip] = from[strip];
		from[strip + 1] += from[strip];
	}
	for (int i = 0; i < index->blob_count; i++) {
		const struct blob *blob = &index->blobs[i];
		int place = next[strip_of(index, blob->x_px)]++;

		index->placed_x_px[place] = blob->x_px;
		index->placed_y_px[place] = blob->y_px;
		index->placed[place] = (int16_t)i;
	}
	for (int k = 0; k < SIGHT_SIDE; k++)
		index->placed_x_px[index->blob_count + k] =
			index->placed_y_px[index->blob_count + k] = INFINITY;
}

void sight_index_build(struct sight_index *index, const struct view *view, const struct blob *blobs,
		       int blob_count)
{
	index->view = view;
	index->blobs = blobs;
	index->blob_count = blob_count;
	index->pixels_per_radian = pixels_per_radian(view);
	index->strips_per_px = (double)SIGHT_STRIP_COUNT / view->width_px;
	sort_into_strips(index);
	for (int i = 0; i < index->blob_count; i++)
		index->owner[i] = -1;
}

void sight_index_list_free(struct sight_index *index)
{
	index->free_count = 0;
	for (int i = 0; i < index->blob_count; i++) {
		double pixel[2] = {index->blobs[i].x_px, index->blobs[i].y_px};

		if (index->owner[i] >= 0)
			continue;
		index->free[index->free_count++] = (int16_t)i;
		view_expect_ray(index->view, pixel);
	}
}

void sight_index_aim_free(struct sight_index *index)
{
	for (int k = 0; k < index->free_count; k++) {
		const struct blob *blob = &index->blobs[index->free[k]];
		double pixel[2] = {blob->x_px, blob->y_px};
		struct vec3 ray = view_ray(index->view, pixel);

		index->ray_x[k] = (float)ray.x;
		index->ray_y[k] = (float)ray.y;
		index->ray_z[k] = (float)ray.z;
	}
}

void sight_index_trim_free(struct sight_index *index)
{
	int kept = 0;

	for (int i = 0; i < index->free_count; i++) {
		if (index->owner[index->free[i]] >= 0)
			continue;
		index->free[kept] = index->free[i];
		index->ray_x[kept] = index->ray_x[i];
		index->ray_y[kept] = index->ray_y[i];
		index->ray_z[kept] = index->ray_z[i];
		kept++;
	}
	index->free_count = kept;
}

/* Those in the strips about a pixel. */
struct placed_range {
	int first, end;
};

static inline struct placed_range placed_around(const struct sight_index *index,
						const double pixel[2], double radius_px)
{
	int first = strip_of(index, pixel[0] - radius_px);
	int last = strip_of(index, pixel[0] + radius_px);

	return (struct placed_range){index->strip_from[first], index->strip_from[last + 1]};
}

static inline double distance2(const struct sight_index *index, int place, const double pixel[2])
{
	double dx = index->placed_x_px[place] - pixel[0];
	double dy = index->placed_y_px[place] - pixel[1];

	return dx * dx + dy * dy;
}

int sight_index_nearest(const struct sight_index *index, const double pixel[2], double radius_px)
{
	struct placed_range range = placed_around(index, pixel, radius_px);
	double best2 = radius_px * radius_px;
	int best = BLOB_NONE;

	for (int place = range.first; place < range.end; place++) {
		double d2 = distance2(index, place, pixel);
		int blob = index->placed[place];
		bool is_best = (d2 < best2) & (index->owner[blob] < 0);

		best = is_best ? blob : best;
		best2 = is_best ? d2 : best2;
	}
	return best;
}

int sight_index_within(const struct sight_index *index, const double pixel[2], double radius_px,
		       int16_t *out, int max)
{
	struct placed_range range = placed_around(index, pixel, radius_px);
	int count = 0;

	for (int place = range.first; place < range.end && count < max; place++)
		if (distance2(index, place, pixel) <= radius_px * radius_px &&
		    index->owner[index->placed[place]] < 0)
			out[count++] = index->placed[place];
	return count;
}

/* Of a number that is not negative: in the same order, and compared without a guess at how it will
 * come out. */
static inline int64_t bits_of(double x)
{
	int64_t bits;

	memcpy(&bits, &x, sizeof(bits));
	return bits;
}

/* Some at a time, so that hardly ever it must be guessed whether there are more: who is placed
 * behind the range is farther off than its strips reach. */
int sight_index_nearest_alone(const struct sight_index *index, const double pixel[2],
			      double radius_px, double alone_px, bool *alone)
{
	struct placed_range range = placed_around(index, pixel, alone_px);
	int64_t best2 = bits_of(radius_px * radius_px), alone2 = bits_of(alone_px * alone_px);
	int best = BLOB_MAX, count = 0;

	for (int first = range.first; first < range.end; first += SIGHT_SIDE)
		for (int place = first; place < first + SIGHT_SIDE; place++) {
			int64_t d2 = bits_of(distance2(index, place, pixel));

			count += d2 < alone2;
			best = d2 < best2 ? place : best;
			best2 = d2 < best2 ? d2 : best2;
		}
	*alone &= count <= 1;
	return best == BLOB_MAX ? BLOB_NONE : index->placed[best];
}
