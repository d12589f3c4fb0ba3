/*
 * A regular grid of 2-vectors over a rectangle, interpolated with bicubic Catmull-Rom patches:
 * continuous values and first derivatives, one cost whatever was sampled.
 * (Keys 1981, "Cubic convolution interpolation for digital image processing": error O(step^3).)
 */
#pragma once

#include <stdbool.h>

struct lens_grid {
	double x0, y0; /* of node (0,0) */
	double x_step, y_step;
	int x_count, y_count; /* at least 4 each */
	double (*node)[2];    /* [y_count][x_count], owned; NaN where nothing is known */
};

/* Returns 0 or -ENOMEM; the nodes are NaN. finish accepts a zeroed grid. */
int lens_grid_init(struct lens_grid *grid, int x_count, int y_count);
void lens_grid_finish(struct lens_grid *grid);

static inline double *lens_grid_node(const struct lens_grid *grid, int x, int y)
{
	return grid->node[(long)y * grid->x_count + x];
}

/* The value at (x, y) and, when `jacobian` is not NULL, its derivative jacobian[i][j] = d value[i]
 * / d (x, y)[j]. Outside the grid's second ring the outermost patch goes on. Real-time safe. */
void lens_grid_at(const struct lens_grid *grid, double x, double y, double value[2],
		  double jacobian[2][2]);

/* Fetches the nodes about (x, y) into the cache. */
void lens_grid_expect(const struct lens_grid *grid, double x, double y);
