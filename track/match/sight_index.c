/*
 * A counting sort of the blobs into square cells.
 */
#include "track/match/sight_index.h"

#include <string.h>

static int clamp(int value, int low, int high)
{
	return value < low ? low : value > high ? high : value;
}

static int cell_of(const struct sight_index *index, double x_px, double y_px)
{
	int column = clamp((int)(x_px * index->cells_per_px), 0, index->column_count - 1);
	int row = clamp((int)(y_px * index->cells_per_px), 0, index->row_count - 1);

	return row * index->column_count + column;
}

static double pixels_per_radian(const struct view *view)
{
	double middle[2] = {view->width_px * 0.5, view->height_px * 0.5};
	double beside[2] = {middle[0] + 1, middle[1]};

	return 1.0 / vec3_distance(view_ray(view, middle), view_ray(view, beside));
}

static void sort_into_cells(struct sight_index *index)
{
	int cell_count = index->column_count * index->row_count;

	memset(index->cell_start, 0, ((size_t)cell_count + 1) * sizeof(index->cell_start[0]));
	for (int i = 0; i < index->blob_count; i++)
		index->cell_start[cell_of(index, index->blobs[i].x_px, index->blobs[i].y_px) + 1]++;
	for (int c = 0; c < cell_count; c++)
		index->cell_start[c + 1] += index->cell_start[c];
	uint16_t fill[CELL_COUNT_MAX];
	memcpy(fill, index->cell_start, (size_t)cell_count * sizeof(fill[0]));
	for (int i = 0; i < index->blob_count; i++) {
		const struct blob *blob = &index->blobs[i];

		index->placed[fill[cell_of(index, blob->x_px, blob->y_px)]++] =
			(struct placed_blob){blob->x_px, blob->y_px, i};
	}
}

void sight_index_build(struct sight_index *index, const struct view *view, const struct blob *blobs,
		       int blob_count)
{
	int longest = view->width_px > view->height_px ? view->width_px : view->height_px;

	index->view = view;
	index->blobs = blobs;
	index->blob_count = blob_count;
	index->pixels_per_radian = pixels_per_radian(view);
	int cell_px = longest / CELLS_ACROSS_MAX + 1;

	index->cells_per_px = 1.0 / cell_px;
	index->column_count = clamp(view->width_px / cell_px + 1, 1, CELLS_ACROSS_MAX);
	index->row_count = clamp(view->height_px / cell_px + 1, 1, CELLS_ACROSS_MAX);
	sort_into_cells(index);
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

struct cell_range {
	int column_first, column_last, row_first, row_last;
};

static struct cell_range cells_around(const struct sight_index *index, const double pixel[2],
				      double radius_px)
{
	double scale = index->cells_per_px;

	return (struct cell_range){
		clamp((int)((pixel[0] - radius_px) * scale), 0, index->column_count - 1),
		clamp((int)((pixel[0] + radius_px) * scale), 0, index->column_count - 1),
		clamp((int)((pixel[1] - radius_px) * scale), 0, index->row_count - 1),
		clamp((int)((pixel[1] + radius_px) * scale), 0, index->row_count - 1)};
}

static double distance2(const struct placed_blob *blob, const double pixel[2])
{
	double dx = blob->x_px - pixel[0], dy = blob->y_px - pixel[1];

	return dx * dx + dy * dy;
}

int sight_index_nearest_alone(const struct sight_index *index, const double pixel[2],
			      double radius_px, double alone_px, bool *alone)
{
	struct cell_range range = cells_around(index, pixel, alone_px);
	double best2 = radius_px * radius_px, alone2 = alone_px * alone_px;
	int best = BLOB_NONE, count = 0;

	for (int row = range.row_first; row <= range.row_last; row++) {
		int first = row * index->column_count + range.column_first;
		int last = row * index->column_count + range.column_last;

		for (int k = index->cell_start[first]; k < index->cell_start[last + 1]; k++) {
			double d2 = distance2(&index->placed[k], pixel);

			if (d2 >= alone2 || index->owner[index->placed[k].index] >= 0)
				continue;
			count++;
			if (d2 < best2) {
				best2 = d2;
				best = index->placed[k].index;
			}
		}
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
	struct cell_range range = cells_around(index, pixel, radius_px);
	int count = 0;

	for (int row = range.row_first; row <= range.row_last; row++) {
		int first = row * index->column_count + range.column_first;
		int last = row * index->column_count + range.column_last;

		for (int k = index->cell_start[first]; k < index->cell_start[last + 1]; k++) {
			int blob = index->placed[k].index;

			if (index->owner[blob] >= 0 || count == max ||
			    distance2(&index->placed[k], pixel) > radius_px * radius_px)
				continue;
			out[count++] = (int16_t)blob;
		}
	}
	return count;
}
