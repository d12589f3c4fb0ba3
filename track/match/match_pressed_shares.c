/*
 * Which share of the light of a spot of two each of them has: what they had when they were last
 * seen alone is old, as discs turn, but the middle between them is one place in space for all
 * cameras, and so each one's spot, drawn to the brighter one, tells.
 */
#include "track/match/match_pressed_parts.h"
#include "track/match/triangulate_parts.h"

#define MIDDLE_SIGMA_M 0.001 /* of where it was expected */
#define SPOT_SIGMA_PX 0.15   /* of a spot of two */
#define SHARE_SIGMA 0.12     /* of a share that was known ... */
#define BLIND_SIGMA 0.2      /* ... or was not */
#define ROBUST_SIGMAS 3.0
#define ROUNDS 3

/* One camera's word on the middle: what its spot is off by, along the line and across. */
struct off {
	double px[2], sigma_px[2];
	struct vec3 slope[2];
};

static struct off off_of(const struct matcher *m, uint32_t c, const struct pressed *pressed,
			 const struct pressed_spot *spot)
{
	const double *one_px = m->seen[c][pressed->seed[0]].pixel;
	const double *other_px = m->seen[c][pressed->seed[1]].pixel;
	const struct projection *q = &m->seen[c][pressed->seed[0]];
	const struct blob *blob = &m->cameras[c].blobs[spot->blob];
	double u[2] = {spot->line[0] / spot->line_px, spot->line[1] / spot->line_px};
	double x = blob->x_px - (one_px[0] + other_px[0]) / 2;
	double y = blob->y_px - (one_px[1] + other_px[1]) / 2;
	struct vec3 jx = slope_of(q, 0), jy = slope_of(q, 1);
	double drawn_px = merged_drawn_px(spot->share, spot->line_px);
	double share_sigma = spot->share_known ? SHARE_SIGMA : BLIND_SIGMA;

	return (struct off){
		{u[0] * x + u[1] * y - drawn_px, u[0] * y - u[1] * x},
		{hypot(SPOT_SIGMA_PX, merged_drawn_px(0.5 + share_sigma, spot->line_px)),
		 SPOT_SIGMA_PX},
		{vec3_add(vec3_scale(jx, u[0]), vec3_scale(jy, u[1])),
		 vec3_sub(vec3_scale(jy, u[0]), vec3_scale(jx, u[1]))}};
}

/* What is left of it when the middle is so far from where it was expected. */
static void leave(struct off *off, struct vec3 shift_m)
{
	for (int k = 0; k < 2; k++)
		off->px[k] -= vec3_dot(off->slope[k], shift_m);
}

static void add_off(const struct off *left, double normal[6], struct vec3 *right)
{
	double z = hypot(left->px[0] / left->sigma_px[0], left->px[1] / left->sigma_px[1]) /
		   ROBUST_SIGMAS;
	double trust = 1 / ((1 + z * z) * (1 + z * z));

	for (int k = 0; k < 2; k++)
		pressed_add_equation(normal, right, left->px[k], left->slope[k],
				     trust / (left->sigma_px[k] * left->sigma_px[k]));
}

static void step(const struct matcher *m, const struct pressed_spots *spots,
		 const struct pressed *pressed, struct vec3 *shift_m)
{
	const double prior = 1 / (MIDDLE_SIGMA_M * MIDDLE_SIGMA_M);
	double normal[6] = {prior, 0, 0, prior, 0, prior}, inverse[6], determinant;
	struct vec3 right = vec3_scale(*shift_m, -prior);

	for (int i = 0; i < spots->count; i++) {
		struct off off = off_of(m, spots->camera[i], pressed, &spots->spot[i]);

		leave(&off, *shift_m);
		add_off(&off, normal, &right);
	}
	if (sym3_invert(normal, inverse, &determinant))
		*shift_m = vec3_add(*shift_m, sym3_apply(inverse, right));
}

void pressed_share(const struct matcher *m, const struct pressed_spots *spots,
		   struct pressed *pressed)
{
	struct vec3 shift_m = {0, 0, 0};

	for (uint32_t c = 0; c < CAMERA_MAX; c++)
		pressed->share[c] = 0;
	for (int round = 0; round < ROUNDS; round++)
		step(m, spots, pressed, &shift_m);
	for (int i = 0; i < spots->count; i++) {
		const struct pressed_spot *spot = &spots->spot[i];
		struct off left = off_of(m, spots->camera[i], pressed, spot);
		double share2_px2 =
			left.sigma_px[0] * left.sigma_px[0] - SPOT_SIGMA_PX * SPOT_SIGMA_PX;

		leave(&left, shift_m);
		double more_px = left.px[0] * share2_px2 / (left.sigma_px[0] * left.sigma_px[0]);
		pressed->share[spots->camera[i]] = merged_share_drawn(
			merged_drawn_px(spot->share, spot->line_px) + more_px, spot->line_px);
	}
}
