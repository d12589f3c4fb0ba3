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

		index->placed[next[strip_of(index, blob->x_px)]++] =
			(struct placed_blob){blob->x_px, blob->y_px, i};
	}
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
		int place = index->free_count;

		if (index->owner[i] >= 0)
			continue;
		struct vec3 ray = view_ray(index->view, pixel);
		index->free[place] = (int16_t)i;
		index->ray_x[place] = (float)ray.x;
		index->ray_y[place] = (float)ray.y;
		index->ray_z[place] = (float)ray.z;
		index->free_count++;
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
	const struct placed_blob *first, *end;
};

static inline struct placed_range placed_around(const struct sight_index *index,
						const double pixel[2], double radius_px)
{
	int first = strip_of(index, pixel[0] - radius_px);
	int last = strip_of(index, pixel[0] + radius_px);

	return (struct placed_range){index->placed + index->strip_from[first],
				     index->placed + index->strip_from[last + 1]};
}

static inline double distance2(const struct placed_blob *blob, const double pixel[2])
{
	double dx = blob->x_px - pixel[0], dy = blob->y_px - pixel[1];

	return dx * dx + dy * dy;
}

int sight_index_nearest_alone(const struct sight_index *index, const double pixel[2],
			      double radius_px, double alone_px, bool *alone)
{
	struct placed_range range = placed_around(index, pixel, alone_px);
	double best2 = radius_px * radius_px, alone2 = alone_px * alone_px;
	int best = BLOB_NONE, count = 0;

	for (const struct placed_blob *blob = range.first; blob < range.end; blob++) {
		double d2 = distance2(blob, pixel);
		bool is_near = (d2 < alone2) & (index->owner[blob->index] < 0);
		bool is_best = is_near & (d2 < best2);

		count += is_near;
		best = is_best ? blob->index : best;
		best2 = is_best ? d2 : best2;
	}
	*alone &= count <= 1;
	return best;
}

int sight_index_nearest(const struct sight_index *index, const double pixel[2], double radius_px)
{
	bool alone = true;

	return sight_index_nearest_alone(index, pixel, radius_px, radius_px, &alone);
}

int sight_index_within(const struct sight_index *index, const double pixel[2], double radius_px,
		       int16_t *out, int max)
{
	struct placed_range range = placed_around(index, pixel, radius_px);
	int count = 0;

	for (const struct placed_blob *blob = range.first; blob < range.end && count < max; blob++)
		if (distance2(blob, pixel) <= radius_px * radius_px &&
		    index->owner[blob->index] < 0)
			out[count++] = (int16_t)blob->index;
	return count;
}
