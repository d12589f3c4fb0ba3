/*
 * Bicubic interpolation of a grid of 2-vectors.
 */
#include "track/lens_grid.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

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

/* The patch of a coordinate in units of steps: its lower node, kept so far inside that all four
 * nodes exist (NaN ends up in the first patch), and the place in it. */
static int find_patch(double steps, int count, double *t)
{
	int patch = steps > 1.0 ? (steps < count - 3 ? (int)steps : count - 3) : 1;

	*t = steps - patch;
	return patch;
}

static void weigh(double t, double w[4])
{
	w[0] = t * (-0.5 + t * (1.0 - 0.5 * t));
	w[1] = 1.0 + t * t * (-2.5 + 1.5 * t);
	w[2] = t * (0.5 + t * (2.0 - 1.5 * t));
	w[3] = t * t * (-0.5 + 0.5 * t);
}

static void weigh_slope(double t, double w[4])
{
	w[0] = -0.5 + t * (2.0 - 1.5 * t);
	w[1] = t * (-5.0 + 4.5 * t);
	w[2] = 0.5 + t * (4.0 - 4.5 * t);
	w[3] = t * (-1.0 + 1.5 * t);
}

/* One row of nodes under four weights. */
static inline void sum_row(const double (*row)[2], const double w[4], double out[2])
{
	for (int k = 0; k < 2; k++)
		out[k] = w[0] * row[0][k] + w[1] * row[1][k] + w[2] * row[2][k] + w[3] * row[3][k];
}

static void value_only(const double (*corner)[2], int stride, const double wx[4],
		       const double wy[4], double value[2])
{
	double along[2];

	value[0] = value[1] = 0;
	for (int j = 0; j < 4; j++) {
		sum_row(corner + (ptrdiff_t)j * stride, wx, along);
		for (int k = 0; k < 2; k++)
			value[k] += wy[j] * along[k];
	}
}

/* The sums for the value and for both slopes in one pass over the nodes. */
static void value_and_slopes(const double (*corner)[2], int stride, const double wx[4],
			     const double wy[4], const double dx[4], const double dy[4],
			     double value[2], double by_x[2], double by_y[2])
{
	double along[2], slope[2];

	for (int k = 0; k < 2; k++)
		value[k] = by_x[k] = by_y[k] = 0;
	for (int j = 0; j < 4; j++) {
		sum_row(corner + (ptrdiff_t)j * stride, wx, along);
		sum_row(corner + (ptrdiff_t)j * stride, dx, slope);
		for (int k = 0; k < 2; k++) {
			value[k] += wy[j] * along[k];
			by_x[k] += wy[j] * slope[k];
			by_y[k] += dy[j] * along[k];
		}
	}
}

void lens_grid_at(const struct lens_grid *grid, double x, double y, double value[2],
		  double jacobian[2][2])
{
	double tx, ty, wx[4], wy[4], dx[4], dy[4], by_x[2], by_y[2];
	int ix = find_patch((x - grid->x0) / grid->x_step, grid->x_count, &tx) - 1;
	int iy = find_patch((y - grid->y0) / grid->y_step, grid->y_count, &ty) - 1;
	const double(*corner)[2] =
		(const double(*)[2]) & grid->node[(ptrdiff_t)iy * grid->x_count + ix];

	weigh(tx, wx);
	weigh(ty, wy);
	if (!jacobian) {
		value_only(corner, grid->x_count, wx, wy, value);
		return;
	}
	weigh_slope(tx, dx);
	weigh_slope(ty, dy);
	value_and_slopes(corner, grid->x_count, wx, wy, dx, dy, value, by_x, by_y);
	for (int k = 0; k < 2; k++) {
		jacobian[k][0] = by_x[k] / grid->x_step;
		jacobian[k][1] = by_y[k] / grid->y_step;
	}
}
