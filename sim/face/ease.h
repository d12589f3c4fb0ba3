/*
 * Smooth ways from 0 to 1 and back. The slope is the kernel (1 - x^2)^3, whose spectrum is first
 * zero at 2.2 / rise: with a rise of half a second nearly nothing is above 4 Hz.
 */
#pragma once

#define EASE_RISE_S 0.5

/* 0 before 0, 1 after 1. */
static inline double ease(double u)
{
	if (u <= 0)
		return 0;
	if (u >= 1)
		return 1;
	return u * u * u * u * (35 - u * (84 - u * (70 - 20 * u)));
}

/* Up from `from_s` on, down again at `to_s`; each takes `rise_s`. */
static inline double swell(double time_s, double from_s, double to_s, double rise_s)
{
	return ease((time_s - from_s) / rise_s) - ease((time_s - to_s + rise_s) / rise_s);
}

/* 1 in the middle, 0 from half the width on. */
static inline double bump(double time_s, double middle_s, double width_s)
{
	double x = 2 * (time_s - middle_s) / width_s, y = 1 - x * x;

	return y > 0 ? y * y * y : 0;
}
