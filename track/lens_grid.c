/*
 * Bicubic interpolation of a grid of 2-vectors.
 */
#include "track/lens_grid.h"

#include <errno.h>
#include <math.h>
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
 * nodes exist (fmax turns NaN into the first patch), and the place in it. */
static int find_patch(double steps, int count, double *t)
{
	int patch = (int)fmax(1.0, fmin(floor(steps), count - 3));

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

/* Sums the 4x4 nodes from (x, y) on with separable weights. */
static void sum_patch(const struct lens_grid *grid, int x, int y, const double wx[4],
		      const double wy[4], double out[2])
{
	out[0] = out[1] = 0;
	for (int j = 0; j < 4; j++) {
		const double(*row)[2] =
			(const double(*)[2]) & grid->node[(long)(y + j) * grid->x_count + x];

		for (int k = 0; k < 2; k++)
			out[k] += wy[j] * (wx[0] * row[0][k] + wx[1] * row[1][k] +
					   wx[2] * row[2][k] + wx[3] * row[3][k]);
	}
}

void lens_grid_at(const struct lens_grid *grid, double x, double y, double value[2],
		  double jacobian[2][2])
{
	double tx, ty, wx[4], wy[4], dx[4], dy[4], by_x[2], by_y[2];
	int ix = find_patch((x - grid->x0) / grid->x_step, grid->x_count, &tx) - 1;
	int iy = find_patch((y - grid->y0) / grid->y_step, grid->y_count, &ty) - 1;

	weigh(tx, wx);
	weigh(ty, wy);
	sum_patch(grid, ix, iy, wx, wy, value);
	if (!jacobian)
		return;
	weigh_slope(tx, dx);
	weigh_slope(ty, dy);
	sum_patch(grid, ix, iy, dx, wy, by_x);
	sum_patch(grid, ix, iy, wx, dy, by_y);
	for (int k = 0; k < 2; k++) {
		jacobian[k][0] = by_x[k] / grid->x_step;
		jacobian[k][1] = by_y[k] / grid->y_step;
	}
}
