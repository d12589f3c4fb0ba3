/*
 * A disc is a sum of points placed by a quadrature rule, so that its first moments are exact:
 * 7 points of degree 5 for small ones (Stroud S2:5-1), three rings of twelve for larger ones.
 */
#include "sim/spot.h"

#include <math.h>
#include <string.h>

#define REACH_SIGMA 4.0
#define TABLE_END 6.0
#define TABLE_COUNT 1024
#define SMALL_RADIUS_PX 1.4
#define POINT_MAX 36

struct disc_point {
	double x, y, weight; /* unit disc; the weights add up to 1 */
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

/* The blurred share of each pixel [first, first + count) of a row or column. */
static void pixel_shares(const struct blur *blur, double centre_px, int first, int count,
			 float *shares)
{
	float step = (float)(1.0 / blur->sigma_px);
	float edge = (float)((first - 0.5 - centre_px) / blur->sigma_px);
	float left = cumulative(blur, edge);

	for (int i = 0; i < count; i++) {
		float right = cumulative(blur, edge + (float)(i + 1) * step);

		shares[i] = right - left;
		left = right;
	}
}

static int ring(struct disc_point *points, double radius, double phase, int count, double weight)
{
	for (int i = 0; i < count; i++) {
		double angle = 2.0 * M_PI * (i + phase) / count;

		points[i] = (struct disc_point){radius * cos(angle), radius * sin(angle),
						weight / count};
	}
	return count;
}

static int disc_points(struct disc_point points[POINT_MAX], double radius)
{
	int count = 0;

	if (radius <= SMALL_RADIUS_PX) {
		points[count++] = (struct disc_point){0, 0, 0.25};
		return count + ring(points + count, sqrt(2.0 / 3.0), 0, 6, 0.75);
	}
	double root = 0.5 * sqrt(0.6); /* Gauss-Legendre in the squared radius */

	count += ring(points + count, sqrt(0.5 - root), 0.0, 12, 5.0 / 18.0);
	count += ring(points + count, sqrt(0.5), 0.5, 12, 8.0 / 18.0);
	count += ring(points + count, sqrt(0.5 + root), 0.0, 12, 5.0 / 18.0);
	return count;
}

static int clamped(double value, int low, int high)
{
	return value < low ? low : value > high ? high : (int)value;
}

static double radius_px(const struct spot *spot)
{
	const double(*a)[2] = spot->axes_px;

	return sqrt(
		fmax(a[0][0] * a[0][0] + a[1][0] * a[1][0], a[0][1] * a[0][1] + a[1][1] * a[1][1]));
}

struct pixel_window spot_window(const struct spot *spot, const struct blur *blur, int width_px,
				int height_px)
{
	double reach = fmin(radius_px(spot) + REACH_SIGMA * blur->sigma_px, SPOT_HALF_WIDTH_PX);
	const double *c = spot->centre_px;

	return (struct pixel_window){clamped(floor(c[0] - reach), 0, width_px),
				     clamped(floor(c[1] - reach), 0, height_px),
				     clamped(ceil(c[0] + reach) + 1, 0, width_px),
				     clamped(ceil(c[1] + reach) + 1, 0, height_px)};
}

static void add_point(const struct blur *blur, double x_px, double y_px, double light_grey,
		      const struct pixel_window *w, float *light)
{
	float columns[SPOT_WINDOW_MAX], rows[SPOT_WINDOW_MAX];
	int width = w->x1 - w->x0, height = w->y1 - w->y0;

	pixel_shares(blur, x_px, w->x0, width, columns);
	pixel_shares(blur, y_px, w->y0, height, rows);
	for (int y = 0; y < height; y++) {
		float share = (float)light_grey * rows[y];

		for (int x = 0; x < width; x++)
			light[y * width + x] += share * columns[x];
	}
}

void spot_fill(const struct spot *spot, const struct blur *blur, const struct pixel_window *window,
	       float *light)
{
	const double(*a)[2] = spot->axes_px;
	struct disc_point points[POINT_MAX];
	double sum = spot->brightness * M_PI * fabs(a[0][0] * a[1][1] - a[0][1] * a[1][0]);
	int count = disc_points(points, radius_px(spot));

	memset(light, 0, (size_t)pixel_window_count(window) * sizeof(*light));
	if (pixel_window_count(window) == 0)
		return;
	for (int i = 0; i < count; i++)
		add_point(blur, spot->centre_px[0] + a[0][0] * points[i].x + a[0][1] * points[i].y,
			  spot->centre_px[1] + a[1][0] * points[i].x + a[1][1] * points[i].y,
			  sum * points[i].weight, window, light);
}

double spot_peak_fraction(double radius_px, double blur_sigma_px)
{
	double variance = blur_sigma_px * blur_sigma_px + 1.0 / 12.0; /* of blur and pixel */

	return 1.0 - exp(-0.5 * radius_px * radius_px / variance);
}
