/*
 * The outline is a sum of rings of points. Ring radii are such that second moments are exact, and
 * the points are near enough to each other for the blur to hide them.
 */
#include "sim/render/spot.h"

#include <math.h>
#include <string.h>

#define REACH_SIGMA 4.0
#define TABLE_END 6.0
#define TABLE_COUNT 1024
#define APART_SIGMA 1.3 /* the ripple of such a comb is 2 exp(-2 pi^2 / 1.3^2): 2e-5 */
#define RING_MAX 40
#define RING_POINTS_MIN 6

struct spread {
	double sigma_px;
	float step; /* 1 / sigma */
	const struct blur *blur;
};

struct ring_point {
	double x, y, light;
};

void blur_init(struct blur *blur, double sigma_px)
{
	blur->sigma_px = sigma_px;
	blur->inverse_step = (TABLE_COUNT - 1) / (2.0 * TABLE_END);
	for (int i = 0; i < TABLE_COUNT; i++)
		blur->cumulative[i] =
			(float)(0.5 * erfc((TABLE_END - i / blur->inverse_step) * M_SQRT1_2));
}

/* Share of a unit Gaussian left of `x_sigma`. */
static float cumulative(const struct blur *blur, float x_sigma)
{
	float place = (x_sigma + (float)TABLE_END) * (float)blur->inverse_step;

	place = place < 0 ? 0 : place > TABLE_COUNT - 1.001f ? TABLE_COUNT - 1.001f : place;
	int cell = (int)place;
	float fraction = place - (float)cell;

	return blur->cumulative[cell] +
	       fraction * (blur->cumulative[cell + 1] - blur->cumulative[cell]);
}

/* A disc of diameter d spreads light by d^2 / 16 along each axis. */
static struct spread spread_of(const struct spot *spot, const struct blur *blur)
{
	double sigma_px =
		sqrt(blur->sigma_px * blur->sigma_px + spot->defocus_px * spot->defocus_px / 16.0);

	return (struct spread){sigma_px, (float)(1.0 / sigma_px), blur};
}

/* The blurred share of each pixel [first, first + count) of a row or column. */
static void pixel_shares(const struct spread *spread, double centre_px, int first, int count,
			 float *shares)
{
	float edge = (float)((first - 0.5 - centre_px) / spread->sigma_px);
	float left = cumulative(spread->blur, edge);

	for (int i = 0; i < count; i++) {
		float right = cumulative(spread->blur, edge + (float)(i + 1) * spread->step);

		shares[i] = right - left;
		left = right;
	}
}

struct pixel_window spot_window(const struct spot *spot, const struct blur *blur, int width_px,
				int height_px)
{
	double reach = spot_radius_px(spot) + REACH_SIGMA * spread_of(spot, blur).sigma_px;

	return pixel_window_around(spot->centre_px, reach, width_px, height_px);
}

/* Adds the light of a point, in the part of the window that it reaches. */
static void add_point(const struct spread *spread, const struct ring_point *point,
		      const struct pixel_window *w, float *light)
{
	float columns[SPOT_WINDOW_MAX], rows[SPOT_WINDOW_MAX];
	double reach = REACH_SIGMA * spread->sigma_px;
	int x0 = (int)fmax(floor(point->x - reach), w->x0);
	int x1 = (int)fmin(ceil(point->x + reach) + 1, w->x1);
	int y0 = (int)fmax(floor(point->y - reach), w->y0);
	int y1 = (int)fmin(ceil(point->y + reach) + 1, w->y1);

	if (x0 >= x1 || y0 >= y1)
		return;
	pixel_shares(spread, point->x, x0, x1 - x0, columns);
	pixel_shares(spread, point->y, y0, y1 - y0, rows);
	for (int y = y0; y < y1; y++) {
		float share = (float)point->light * rows[y - y0];
		float *row = light + (y - w->y0) * (w->x1 - w->x0) + x0 - w->x0;

		for (int x = 0; x < x1 - x0; x++)
			row[x] += share * columns[x];
	}
}

static struct ring_point point_at(const struct spot *spot, double radius, double angle,
				  double light)
{
	double x = radius * cos(angle), y = radius * sin(angle);
	double keep = y < 0 ? 1 - spot->squeeze : 1;
	const double(*a)[2] = spot->axes_px;

	y *= keep;
	return (struct ring_point){spot->centre_px[0] + a[0][0] * x + a[0][1] * y,
				   spot->centre_px[1] + a[1][0] * x + a[1][1] * y, light * keep};
}

/* Even, so that no point lies on the line between a hemisphere's halves. */
static int ring_count(double length_px, double apart_px)
{
	return 2 * (int)ceil(fmax(0.5 * length_px / apart_px, RING_POINTS_MIN / 2));
}

/* Half rings lack the symmetry that makes whole ones exact: they take more points. */
static double point_distance_px(const struct spot *spot, const struct spread *spread)
{
	double apart_px = APART_SIGMA * spread->sigma_px;

	return spot->squeeze > 0 ? fmin(0.5 * apart_px, 0.2 * spot_radius_px(spot)) : apart_px;
}

/* Of the ring from r to r + 1: its rms, which makes a whole disc's second moments exact, or its
 * mean, which makes the first moments of halves exact. */
static double ring_radius(const struct spot *spot, double r)
{
	return spot->squeeze > 0 ? (3 * r * r + 3 * r + 1) / (3 * r + 1.5) : sqrt(r * r + r + 0.5);
}

void spot_fill(const struct spot *spot, const struct blur *blur, const struct pixel_window *window,
	       float *light)
{
	struct spread spread = spread_of(spot, blur);
	double radius_px = spot_radius_px(spot), apart_px = point_distance_px(spot, &spread);
	double sum = spot_light(spot) / (1 - 0.5 * spot->squeeze);
	int rings = (int)fmin(ceil(radius_px / apart_px), RING_MAX);

	memset(light, 0, (size_t)pixel_window_count(window) * sizeof(*light));
	for (int r = 0; r < rings; r++) {
		double area = 2.0 * r + 1, whole = (double)rings * rings;
		double radius = ring_radius(spot, r) / rings;
		int count = ring_count(2 * M_PI * radius * radius_px, apart_px);

		for (int i = 0; i < count; i++) {
			struct ring_point point =
				point_at(spot, radius, 2 * M_PI * (i + 0.5) / count,
					 sum * area / whole / count);

			add_point(&spread, &point, window, light);
		}
	}
}

double spot_peak_fraction(double radius_px, double blur_sigma_px)
{
	double variance = blur_sigma_px * blur_sigma_px + 1.0 / 12.0; /* of blur and pixel */

	return 1.0 - exp(-0.5 * radius_px * radius_px / variance);
}
