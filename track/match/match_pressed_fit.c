/*
 * The way from an upper lip's marker to the lower one's, fitted in space to the spreads of all
 * spots that hold both.
 */
#include "track/match/match_pressed_parts.h"
#include "track/match/triangulate_parts.h"

#define SPREAD_SIGMA_PX2 0.2    /* of a spot's spread */
#define LINE_SHARE 0.25         /* of the line's square: a spread tells it no better */
#define EXPECTED_SIGMA_M 0.0008 /* of the way from one to the other */
#define ROBUST_SIGMAS 2.0
#define WAY_ROBUST_SIGMAS 4.0 /* of a way that a camera tells */
#define LENIENCE 8.0          /* times as many in the first round, as the way may be far off yet */
#define ROUNDS 5
#define EVIDENCE_SIGMAS 3.0 /* what one spot tells at most */

void pressed_add_equation(double normal[6], struct vec3 *right, double error, struct vec3 slope,
			  double weight)
{
	*right = vec3_add(*right, vec3_scale(slope, weight * error));
	sym3_add(normal,
		 (double[]){slope.x * slope.x, slope.x * slope.y, slope.x * slope.z,
			    slope.y * slope.y, slope.y * slope.z, slope.z * slope.z},
		 weight);
}

/* Of what a spot says of such a line. */
static double spread_sigma_px2(const struct pressed_spot *spot, const double line_px[2])
{
	return hypot(SPREAD_SIGMA_PX2 / (spot->share * (1 - spot->share)),
		     LINE_SHARE * (line_px[0] * line_px[0] + line_px[1] * line_px[1]));
}

/* The line that two so far apart have in the camera, and by how much its spot says otherwise: it
 * tells x^2 - y^2 and 2 x y, as its spread has no direction, and x^2 + y^2 where it is known how
 * wide either is alone. */
static void compare_line(const struct matcher *m, uint32_t c, const struct pressed *pressed,
			 const struct pressed_spot *spot, double line_px[2], double off_px2[3])
{
	const struct projection *q = &m->seen[c][pressed->seed[0]];

	for (int k = 0; k < 2; k++)
		line_px[k] = project_slope(q, k, pressed->apart_m);
	off_px2[0] = spot->longer_px2[0] - (line_px[0] * line_px[0] - line_px[1] * line_px[1]);
	off_px2[1] = spot->longer_px2[1] - 2 * line_px[0] * line_px[1];
	off_px2[2] = spot->alone_known ? spot->longer_px2[2] -
						 (line_px[0] * line_px[0] + line_px[1] * line_px[1])
				       : 0;
}

/* A spot that says much else is another marker's too (Geman-McClure). The kernel narrows round by
 * round (graduated non-convexity; Yang et al. 2020): a way that is far off yet would else make
 * outliers of all who know better. */
static void add_spot(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		     const struct pressed_spot *spot, double lenience, double normal[6],
		     struct vec3 *right)
{
	const struct projection *q = &m->seen[c][pressed->seed[0]];
	struct vec3 jx = slope_of(q, 0), jy = slope_of(q, 1);
	double line_px[2], off_px2[3];

	compare_line(m, c, pressed, spot, line_px, off_px2);
	double x = line_px[0], y = line_px[1], sigma_px2 = spread_sigma_px2(spot, line_px);
	double far = hypot(hypot(off_px2[0], off_px2[1]), off_px2[2]) /
		     (lenience * ROBUST_SIGMAS * sigma_px2);
	double weight = 1 / (sigma_px2 * (1 + far * far));

	pressed_add_equation(normal, right, off_px2[0],
			     vec3_sub(vec3_scale(jx, 2 * x), vec3_scale(jy, 2 * y)),
			     weight * weight);
	pressed_add_equation(normal, right, off_px2[1],
			     vec3_add(vec3_scale(jx, 2 * y), vec3_scale(jy, 2 * x)),
			     weight * weight);
	if (spot->alone_known)
		pressed_add_equation(normal, right, off_px2[2],
				     vec3_add(vec3_scale(jx, 2 * x), vec3_scale(jy, 2 * y)),
				     weight * weight);
}

/* By how much the camera's two spots say another way, in so many of their sigmas. */
static double off_way(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		      const struct pressed_spots *spots, double off_px[2])
{
	const struct projection *q = &m->seen[c][pressed->seed[0]];

	for (int k = 0; k < 2; k++)
		off_px[k] = spots->apart_px[c][k] - project_slope(q, k, pressed->apart_m);
	return hypot(off_px[0], off_px[1]) / spots->apart_sigma_px[c];
}

/* Where others crowd about the two, one of the spots may be theirs: robust as well. */
static void add_way(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		    const struct pressed_spots *spots, double lenience, double normal[6],
		    struct vec3 *right)
{
	const struct projection *q = &m->seen[c][pressed->seed[0]];
	double off_px[2];
	double far = off_way(m, c, pressed, spots, off_px) / (lenience * WAY_ROBUST_SIGMAS);
	double weight = 1 / (spots->apart_sigma_px[c] * (1 + far * far));

	for (int k = 0; k < 2; k++)
		pressed_add_equation(normal, right, off_px[k], slope_of(q, k), weight * weight);
}

/* Gauss-Newton from what is known so far. */
bool pressed_fit(const struct matcher *m, const struct pressed_spots *spots,
		 struct pressed *pressed)
{
	const double prior = 1 / (EXPECTED_SIGMA_M * EXPECTED_SIGMA_M);

	for (int round = 0; round < ROUNDS; round++) {
		double lenience = LENIENCE / (1 + round * (LENIENCE - 1) / (ROUNDS - 1));
		double normal[6] = {prior, 0, 0, prior, 0, prior}, inverse[6], determinant;
		struct vec3 right =
			vec3_scale(vec3_sub(pressed->expected_m, pressed->apart_m), prior);

		for (uint32_t left = spots->apart_mask; left; left &= left - 1)
			add_way(m, (uint32_t)__builtin_ctz(left), pressed, spots, lenience, normal,
				&right);
		for (int i = 0; i < spots->count; i++)
			add_spot(m, spots->camera[i], pressed, &spots->spot[i], lenience, normal,
				 &right);
		if (!sym3_invert(normal, inverse, &determinant))
			return false;
		pressed->apart_m = vec3_add(pressed->apart_m, sym3_apply(inverse, right));
	}
	return true;
}

void pressed_drop_ways(const struct matcher *m, const struct pressed *pressed,
		       struct pressed_spots *spots)
{
	for (uint32_t left = spots->apart_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		double off_px[2];

		if (off_way(m, c, pressed, spots, off_px) > WAY_ROBUST_SIGMAS)
			spots->apart_mask &= ~(1u << c);
	}
}

static double bounded(double z2)
{
	return z2 / (1 + z2 / (EVIDENCE_SIGMAS * EVIDENCE_SIGMAS));
}

/* In squared sigmas, Geman-McClure. */
static double misfit(const double off_px2[3], bool alone_known, double sigma_px2)
{
	double third = alone_known ? off_px2[2] * off_px2[2] : 0;
	double z2 = (off_px2[0] * off_px2[0] + off_px2[1] * off_px2[1] + third) /
		    (sigma_px2 * sigma_px2);

	return bounded(z2);
}

double pressed_gain(const struct matcher *m, uint32_t c, const struct pressed *pressed,
		    const struct pressed_spot *spot)
{
	const double none_px[2] = {0, 0};
	double line_px[2], off_px2[3];

	compare_line(m, c, pressed, spot, line_px, off_px2);
	return misfit(spot->longer_px2, spot->alone_known, spread_sigma_px2(spot, none_px)) -
	       misfit(off_px2, spot->alone_known, spread_sigma_px2(spot, line_px));
}

double pressed_surprise(const struct pressed *pressed)
{
	double off = vec3_distance(pressed->apart_m, pressed->expected_m) / EXPECTED_SIGMA_M;

	return bounded(off * off);
}
