/*
 * Bicubic interpolation of a grid of 2-vectors.
 */
#include "track/lens_grid.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "track/lens_grid_parts.h"

int lens_grid_init(struct lens_grid *grid, int x_count, int y_count)
{
	long count = (long)x_count * y_count;
	double(*node)[2] = malloc((size_t)count * sizeof(*node));

	if (!node)
		return -ENOMEM;
	for (long i = 0; i < count; i++)
		node[i][0] = node[i][1] = NAN;
	grid->x_count = x_count;
	grid->y_count = y_count;
	grid->node = node;
	return 0;
}

void lens_grid_finish(struct lens_grid *grid)
{
	free(grid->node);
	memset(grid, 0, sizeof(*grid));
}

/* Both components of a node at once; the same sums as one by one. */
typedef double pair __attribute__((vector_size(16)));

static inline pair load(const double node[2])
{
	return (pair){node[0], node[1]};
}

/* One row of nodes under four weights. */
static inline pair sum_row(const double (*row)[2], const double w[4])
{
	return w[0] * load(row[0]) + w[1] * load(row[1]) + w[2] * load(row[2]) +
	       w[3] * load(row[3]);
}

static void value_only(const double (*corner)[2], int stride, const double wx[4],
		       const double wy[4], double value[2])
{
	pair sum = {0, 0};

	for (int j = 0; j < 4; j++)
		sum += wy[j] * sum_row(corner + (ptrdiff_t)j * stride, wx);
	value[0] = sum[0];
	value[1] = sum[1];
}

/* The sums for the value and for both slopes in one pass over the nodes. */
static void value_and_slopes(const double (*corner)[2], int stride, const double wx[4],
			     const double wy[4], const double dx[4], const double dy[4],
			     double value[2], double by_x[2], double by_y[2])
{
	pair sum = {0, 0}, sum_x = {0, 0}, sum_y = {0, 0};

	for (int j = 0; j < 4; j++) {
		pair along = sum_row(corner + (ptrdiff_t)j * stride, wx);

		sum += wy[j] * along;
		sum_y += dy[j] * along;
		sum_x += wy[j] * sum_row(corner + (ptrdiff_t)j * stride, dx);
	}
	for (int k = 0; k < 2; k++) {
		value[k] = sum[k];
		by_x[k] = sum_x[k];
		by_y[k] = sum_y[k];
	}
}

void lens_grid_at(const struct lens_grid *grid, double x, double y, double value[2],
		  double jacobian[2][2])
{
	double tx, ty, wx[4], wy[4], dx[4], dy[4], by_x[2], by_y[2];
	double steps_per_x = 1 / grid->x_step, steps_per_y = 1 / grid->y_step;
	int ix = lens_grid_patch((x - grid->x0) * steps_per_x, grid->x_count, &tx) - 1;
	int iy = lens_grid_patch((y - grid->y0) * steps_per_y, grid->y_count, &ty) - 1;
	const double(*corner)[2] =
		(const double(*)[2]) & grid->node[(ptrdiff_t)iy * grid->x_count + ix];

	lens_grid_weigh(tx, wx);
	lens_grid_weigh(ty, wy);
	if (!jacobian) {
		value_only(corner, grid->x_count, wx, wy, value);
		return;
	}
	lens_grid_weigh_slope(tx, dx);
	lens_grid_weigh_slope(ty, dy);
	value_and_slopes(corner, grid->x_count, wx, wy, dx, dy, value, by_x, by_y);
	for (int k = 0; k < 2; k++) {
		jacobian[k][0] = by_x[k] * steps_per_x;
		jacobian[k][1] = by_y[k] * steps_per_y;
	}
}

void lens_grid_expect(const struct lens_grid *grid, double x, double y)
{
	double t;
	int ix = lens_grid_patch((x - grid->x0) / grid->x_step, grid->x_count, &t) - 1;
	int iy = lens_grid_patch((y - grid->y0) / grid->y_step, grid->y_count, &t) - 1;

	for (int j = 0; j < 4; j++) {
		const double *row = lens_grid_node(grid, ix, iy + j);

		__builtin_prefetch(row);
		__builtin_prefetch(row + 7); /* the last of its four nodes */
	}
}
