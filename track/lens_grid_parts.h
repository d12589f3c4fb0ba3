/*
 * One coordinate of a place in a grid: for one place at a time and for many side by side.
 */
#pragma once

/* The patch of a coordinate in units of steps: its lower node, kept so far inside that all four
 * nodes exist (NaN ends up in the first patch), and the place in it. */
static inline int lens_grid_patch(double steps, int count, double *t)
{
	int patch = steps > 1.0 ? (steps < count - 3 ? (int)steps : count - 3) : 1;

	*t = steps - patch;
	return patch;
}

static inline void lens_grid_weigh(double t, double w[4])
{
	w[0] = t * (-0.5 + t * (1.0 - 0.5 * t));
	w[1] = 1.0 + t * t * (-2.5 + 1.5 * t);
	w[2] = t * (0.5 + t * (2.0 - 1.5 * t));
	w[3] = t * t * (-0.5 + 0.5 * t);
}

static inline void lens_grid_weigh_slope(double t, double w[4])
{
	w[0] = -0.5 + t * (2.0 - 1.5 * t);
	w[1] = t * (-5.0 + 4.5 * t);
	w[2] = 0.5 + t * (4.0 - 4.5 * t);
	w[3] = t * (-1.0 + 1.5 * t);
}
