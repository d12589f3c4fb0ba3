/*
 * A disc is a sum of points placed by a quadrature rule, so that its first moments are exact:
 * 7 points of degree 5 for small ones (Stroud S2:5-1), three rings of twelve for larger ones.
 */
#include "sim/spot.h"

#include <math.h>

#define REACH_SIGMA 4.5
#define TABLE_END 6.0
#define TABLE_COUNT 1024
#define SMALL_RADIUS_PX 1.4
#define POINT_MAX 36
#define WIDTH_MAX (2 * SPOT_HALF_WIDTH_PX + 2)

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
static float cumulative(const struct blur *blur, double x_sigma)
{
	double place = (x_sigma + TABLE_END) * blur->inverse_step;

	if (place <= 0)
		return 0;
	if (place >= TABLE_COUNT - 1)
		return 1;
	int cell = (int)place;
	float fraction = (float)(place - cell);

	return blur->cumulative[cell] +
	       fraction * (blur->cumulative[cell + 1] - blur->cumulative[cell]);
}

/* The blurred share of each pixel [first, first + count) of a row or column. */
static void pixel_shares(const struct blur *blur, double centre_px, int first, int count,
			 float *shares)
{
	double inverse = 1.0 / blur->sigma_px;
	float left = cumulative(blur, (first - 0.5 - centre_px) * inverse);

	for (int i = 0; i < count; i++) {
		float right = cumulative(blur, (first + i + 0.5 - centre_px) * inverse);

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

static int disc_points(struct disc_point points[POINT_MAX], double radius_px)
{
	int count = 0;

	if (radius_px <= SMALL_RADIUS_PX) {
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

static struct pixel_window window_of(const struct spot *spot, double reach_px, int width_px,
				     int height_px)
{
	double reach = fmin(reach_px, SPOT_HALF_WIDTH_PX);
	const double *c = spot->centre_px;

	return (struct pixel_window){clamped(floor(c[0] - reach), 0, width_px),
				     clamped(floor(c[1] - reach), 0, height_px),
				     clamped(ceil(c[0] + reach) + 1, 0, width_px),
				     clamped(ceil(c[1] + reach) + 1, 0, height_px)};
}

static void add_point(const struct blur *blur, double x_px, double y_px, double light,
		      const struct pixel_window *w, float *plane, int stride)
{
	float columns[WIDTH_MAX], rows[WIDTH_MAX];
	int width = w->x1 - w->x0, height = w->y1 - w->y0;

	pixel_shares(blur, x_px, w->x0, width, columns);
	pixel_shares(blur, y_px, w->y0, height, rows);
	for (int y = 0; y < height; y++) {
		float *line = plane + (long)(w->y0 + y) * stride + w->x0;
		float share = (float)light * rows[y];

		for (int x = 0; x < width; x++)
			line[x] += share * columns[x];
	}
}

struct pixel_window spot_add(const struct spot *spot, const struct blur *blur, float *plane,
			     int width_px, int height_px)
{
	const double(*a)[2] = spot->axes_px;
	struct disc_point points[POINT_MAX];
	double radius_px = sqrt(
		fmax(a[0][0] * a[0][0] + a[1][0] * a[1][0], a[0][1] * a[0][1] + a[1][1] * a[1][1]));
	double light = spot->brightness * M_PI * fabs(a[0][0] * a[1][1] - a[0][1] * a[1][0]);
	struct pixel_window window =
		window_of(spot, radius_px + REACH_SIGMA * blur->sigma_px, width_px, height_px);
	int count = disc_points(points, radius_px);

	if (window.x0 >= window.x1 || window.y0 >= window.y1)
		return (struct pixel_window){0, 0, 0, 0};
	for (int i = 0; i < count; i++)
		add_point(blur, spot->centre_px[0] + a[0][0] * points[i].x + a[0][1] * points[i].y,
			  spot->centre_px[1] + a[1][0] * points[i].x + a[1][1] * points[i].y,
			  light * points[i].weight, &window, plane, width_px);
	return window;
}

double spot_peak_fraction(double radius_px, double blur_sigma_px)
{
	double variance = blur_sigma_px * blur_sigma_px + 1.0 / 12.0; /* of blur and pixel */

	return 1.0 - exp(-0.5 * radius_px * radius_px / variance);
}
