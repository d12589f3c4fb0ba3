/*
 * A spot's profile by quadrature, kept while the next is alike; its pixels from the profile.
 */
#include "tests/bench/spot_model.h"

#include <math.h>
#include <stdbool.h>

#include "tests/bench/blobs.h"

#define PROFILE_STEP_PX 0.05
#define PROFILE_COUNT 720 /* 36 px */
#define RING_COUNT 240    /* of the quadrature */
#define GAUSS_POINTS 5    /* along each side of a pixel */
#define MOFFAT_EXPONENT 3
#define INFORMATION_STEP 0.125 /* grey values */
#define INFORMATION_COUNT (8 * 512)

/* For an amplitude of 1. */
struct profile {
	double value[PROFILE_COUNT];
};

/* The point spread, to a factor. */
static double point_spread(const struct spot_model *model, double r)
{
	double half_px = 1.17741 * model->blur_px; /* half width at half height */
	double scale = half_px * half_px / (pow(2, 1.0 / MOFFAT_EXPONENT) - 1);

	if (model->spread == SPREAD_GAUSS)
		return exp(-0.5 * r * r / (model->blur_px * model->blur_px));
	return pow(1 + r * r / scale, -MOFFAT_EXPONENT);
}

/* Share of the circle of radius s around a point at distance r that lies in the disc. */
static double share_in_disc(double s, double r, double disc_px)
{
	double c;

	if (s + r <= disc_px)
		return 1;
	if (s >= r + disc_px || r >= s + disc_px)
		return 0;
	c = (s * s + r * r - disc_px * disc_px) / (2 * s * r);
	return acos(fmin(fmax(c, -1), 1)) / M_PI;
}

/* The radii s between which the circle passes the disc's edge carry the steep part: they get their
 * own points, crowded towards both ends by a cosine. */
static double ring_integral(const struct spot_model *model, double r, double from, double to)
{
	double disc_px = model->diameter_px / 2, sum = 0;

	if (to <= from)
		return 0;
	for (int i = 0; i < RING_COUNT; i++) {
		double t = M_PI * (i + 0.5) / RING_COUNT;
		double s = from + (to - from) * (1 - cos(t)) / 2;

		sum += point_spread(model, s) * s * share_in_disc(s, r, disc_px) * sin(t);
	}
	return sum * (to - from) / 2 * M_PI / RING_COUNT;
}

static double profile_at(const struct spot_model *model, double r)
{
	double disc_px = model->diameter_px / 2, edge = fabs(disc_px - r);

	return (r < disc_px ? ring_integral(model, r, 0, edge) : 0) +
	       ring_integral(model, r, edge, disc_px + r);
}

static void make_profile(struct profile *profile, const struct spot_model *model)
{
	double scale = 1 / profile_at(model, 0);

	for (int i = 0; i < PROFILE_COUNT; i++)
		profile->value[i] = scale * profile_at(model, i * PROFILE_STEP_PX);
}

/* Cubic between the samples; a mirror at r = 0. Sets the slope by r, too. */
static double look_up(const struct profile *profile, double r, double *slope)
{
	int i = (int)(r / PROFILE_STEP_PX);
	double u = r / PROFILE_STEP_PX - i;
	const double *v = profile->value;

	if (i + 2 >= PROFILE_COUNT) {
		*slope = 0;
		return 0;
	}
	double before = v[i > 0 ? i - 1 : 1], a = v[i], b = v[i + 1], after = v[i + 2];
	double c1 = (b - before) / 2, c2 = before - 2.5 * a + 2 * b - after / 2;
	double c3 = 1.5 * (a - b) + (after - before) / 2;

	*slope = (c1 + u * (2 * c2 + u * 3 * c3)) / PROFILE_STEP_PX;
	return a + u * (c1 + u * (c2 + u * c3));
}

static void draw_pixel(struct spot_stamp *stamp, const struct profile *profile, double amplitude,
		       int i, int j, double x, double y)
{
	static const double node[GAUSS_POINTS] = {-0.4530899230, -0.2692346551, 0, 0.2692346551,
						  0.4530899230};
	static const double weight[GAUSS_POINTS] = {0.1184634425, 0.2393143352, 0.2844444444,
						    0.2393143352, 0.1184634425};
	double light = 0, slope_x = 0, slope_y = 0;

	for (int b = 0; b < GAUSS_POINTS; b++)
		for (int a = 0; a < GAUSS_POINTS; a++) {
			double dx = i - STAMP_HALF_PX + node[a] - x;
			double dy = j - STAMP_HALF_PX + node[b] - y, r = hypot(dx, dy), slope;
			double w = amplitude * weight[a] * weight[b];

			light += w * look_up(profile, r, &slope);
			if (r > 0) {
				slope_x -= w * slope * dx / r;
				slope_y -= w * slope * dy / r;
			}
		}
	stamp->light[j][i] = (float)light;
	stamp->slope_x[j][i] = (float)slope_x;
	stamp->slope_y[j][i] = (float)slope_y;
}

void spot_stamp_draw(struct spot_stamp *stamp, const struct spot_model *model, double x, double y)
{
	static struct profile profile;
	static struct spot_model of;

	if (of.spread != model->spread || of.diameter_px != model->diameter_px ||
	    of.blur_px != model->blur_px)
		make_profile(&profile, model);
	of = *model;
	for (int j = 0; j < STAMP_PX; j++)
		for (int i = 0; i < STAMP_PX; i++)
			draw_pixel(stamp, &profile, model->amplitude, i, j, x, y);
}

static double noise_sigma(double light)
{
	return sqrt(BENCH_READ_NOISE * BENCH_READ_NOISE + light / BENCH_ELECTRONS_PER_GREY);
}

/* Probability that light reads as `grey`, rounded and clipped. */
static double probability(double light, int grey)
{
	double scale = 1 / (noise_sigma(light) * M_SQRT2);
	double low = grey == 0 ? -1 : erf((grey - 0.5 - light) * scale);
	double high = grey == 255 ? 1 : erf((grey + 0.5 - light) * scale);

	return (high - low) / 2;
}

/* Fisher information on the light: the sum over grey values of (dP / dlight)2 / P. */
static double information(double light)
{
	const double h = 0.01;
	int reach = (int)(6 * noise_sigma(light)) + 1;
	int low = (int)fmin(fmax(light - reach, 0), 255);
	int high = (int)fmax(fmin(light + reach, 255), 0);
	double sum = 0;

	for (int grey = low; grey <= high; grey++) {
		double p = probability(light, grey);
		double slope =
			(probability(light + h, grey) - probability(light - h, grey)) / (2 * h);

		if (p > 1e-12)
			sum += slope * slope / p;
	}
	return sum;
}

static double information_at(double light)
{
	static double table[INFORMATION_COUNT];
	static bool known;
	int i = (int)(light / INFORMATION_STEP);

	if (!known)
		for (int k = 0; k < INFORMATION_COUNT; k++)
			table[k] = information((k + 0.5) * INFORMATION_STEP);
	known = true;
	return i < INFORMATION_COUNT ? table[i] : 0;
}

double spot_stamp_bound(const struct spot_stamp *stamp)
{
	double xx = 0, xy = 0, yy = 0;

	for (int j = 0; j < STAMP_PX; j++)
		for (int i = 0; i < STAMP_PX; i++) {
			double told = information_at(stamp->light[j][i] + BENCH_BACKGROUND);
			double x = stamp->slope_x[j][i], y = stamp->slope_y[j][i];

			xx += told * x * x;
			xy += told * x * y;
			yy += told * y * y;
		}
	return sqrt((xx + yy) / (2 * (xx * yy - xy * xy)));
}

uint8_t exposed_pixel(double light, struct rng *rng)
{
	double value = floor(light + noise_sigma(light) * rng_normal(rng) + 0.5);

	return (uint8_t)fmin(fmax(value, 0), 255);
}
