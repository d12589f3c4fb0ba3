/*
 * The profile m(s) of a unit disc of radius r blurred by a unit Gaussian falls by
 * r exp(-(s^2 + r^2) / 2) I1(s r); one walk from far outside to the middle sums it up and, for
 * every brightness B, the information pi (B m')^2 s / (variance + B m / electrons).
 */
#include "sim/render/spot_bound.h"

#include <math.h>
#include <string.h>

#define SIZE_MIN 0.2
#define SIZE_STEP 1.27 /* ratio of neighbours: up to 49 */
#define GREY_MIN 5.0
#define GREY_STEP 1.26 /* up to 2600 */
#define STEP 0.05
#define FAR_OUT 6.0

/* exp(-x) I1(x): Abramowitz and Stegun 9.8.3 and 9.8.4. */
static double scaled_bessel(double x)
{
	double t = x / 3.75;

	if (t < 1) {
		double u = t * t;

		return exp(-x) * x *
		       (0.5 +
			u * (0.87890594 +
			     u * (0.51498869 +
				  u * (0.15084934 +
				       u * (0.02658733 + u * (0.00301532 + u * 0.00032411))))));
	}
	t = 1 / t;
	return (0.39894228 +
		t * (-0.03988024 +
		     t * (-0.00362018 +
			  t * (0.00163801 +
			       t * (-0.01031555 +
				    t * (0.02282967 +
					 t * (-0.02895312 +
					      t * (0.01787654 - t * 0.00420059)))))))) /
	       sqrt(x);
}

static void walk(struct bound row[BOUND_GREYS], double size, double variance, double electrons)
{
	double information[BOUND_GREYS] = {0}, profile = 0;

	for (double s = size + FAR_OUT; s > 0; s -= STEP) {
		double slope = size * exp(-0.5 * (s - size) * (s - size)) * scaled_bessel(s * size);
		double grey = GREY_MIN;

		profile += slope * STEP;
		for (int g = 0; g < BOUND_GREYS; g++, grey *= GREY_STEP) {
			double lit = grey * profile;

			if (lit > BOUND_THRESHOLD_GREY && row[g].reach_sigma == 0)
				row[g].reach_sigma = (float)s;
			if (lit < 255 - BOUND_BLACK_GREY)
				information[g] += M_PI * grey * grey * slope * slope * s * STEP /
						  (variance + lit / electrons);
			row[g].peak_grey = (float)lit;
		}
	}
	for (int g = 0; g < BOUND_GREYS; g++)
		row[g].sigma_px = (float)(1 / sqrt(information[g] + 1e-6));
}

void bound_table_init(struct bound_table *table, double variance_grey2, double electrons_per_grey)
{
	double size = SIZE_MIN;

	memset(table, 0, sizeof(*table));
	for (int i = 0; i < BOUND_SIZES; i++, size *= SIZE_STEP)
		walk(table->at[i], size, variance_grey2, electrons_per_grey);
}

/* Logarithmic place in a scale, kept inside it. */
static int find_cell(double value, double least, double log_step, int count, float *share)
{
	double place = log(fmax(value, least) / least) / log_step;

	place = fmin(place, count - 1.001);
	*share = (float)(place - (int)place);
	return (int)place;
}

static float mixed(float a, float b, float share)
{
	return a + share * (b - a);
}

static struct bound mixed_bound(const struct bound *a, const struct bound *b, float share)
{
	return (struct bound){mixed(a->sigma_px, b->sigma_px, share),
			      mixed(a->reach_sigma, b->reach_sigma, share),
			      mixed(a->peak_grey, b->peak_grey, share)};
}

struct bound bound_of(const struct bound_table *table, double size, double grey)
{
	float size_share, grey_share;
	int i = find_cell(size, SIZE_MIN, log(SIZE_STEP), BOUND_SIZES, &size_share);
	int g = find_cell(grey, GREY_MIN, log(GREY_STEP), BOUND_GREYS, &grey_share);
	struct bound low = mixed_bound(&table->at[i][g], &table->at[i][g + 1], grey_share);
	struct bound high = mixed_bound(&table->at[i + 1][g], &table->at[i + 1][g + 1], grey_share);
	struct bound bound = mixed_bound(&low, &high, size_share);

	if (bound.peak_grey < (float)BOUND_THRESHOLD_GREY)
		bound.reach_sigma = 0;
	return bound;
}
