/*
 * Painted once, by layers: tone, hair, features, and a shading that turns with the head.
 */
#include "sim/render/hd_paint.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "base/geometry.h"
#include "base/rng.h"

#define MOUTH_Y -0.645f
#define MOUTH_HALF_WIDTH 0.33f
#define CHIN_Y -1.05f
#define EYE_X 0.38
#define EYE_Y 0.045
#define EYE_HALF_WIDTH 0.17
#define EYE_HALF_HEIGHT 0.075

/* An ellipse painted on the front of the unit sphere. */
struct patch {
	double x, y, half_width, half_height;
	uint8_t colour[HD_COLOURS];
	bool follows_hair; /* in the hair's colour */
};

/* Dark: the lens is stopped down for the light that markers send back. */
static const double SKIN[HD_COLOURS] = {76, 57, 47}, HAIR[HD_COLOURS] = {27, 20, 15};

static const struct patch PATCHES[] = {
	{EYE_X, EYE_Y, 0.21, 0.11, {60, 43, 36}, false},
	{-EYE_X, EYE_Y, 0.21, 0.11, {60, 43, 36}, false},
	{EYE_X, EYE_Y, EYE_HALF_WIDTH, EYE_HALF_HEIGHT, {76, 74, 71}, false},
	{-EYE_X, EYE_Y, EYE_HALF_WIDTH, EYE_HALF_HEIGHT, {76, 74, 71}, false},
	{EYE_X, EYE_Y, 0.068, 0.072, {32, 44, 40}, false},
	{-EYE_X, EYE_Y, 0.068, 0.072, {32, 44, 40}, false},
	{EYE_X, EYE_Y, 0.03, 0.033, {8, 8, 8}, false},
	{-EYE_X, EYE_Y, 0.03, 0.033, {8, 8, 8}, false},
	{EYE_X + 0.02, EYE_Y + 0.03, 0.016, 0.016, {150, 150, 150}, false},
	{-EYE_X + 0.02, EYE_Y + 0.03, 0.016, 0.016, {150, 150, 150}, false},
	{0.40, 0.29, 0.26, 0.045, {0, 0, 0}, true},
	{-0.40, 0.29, 0.26, 0.045, {0, 0, 0}, true},
	{0.0, -0.28, 0.16, 0.13, {66, 46, 38}, false},
	{0.08, -0.37, 0.04, 0.025, {30, 20, 18}, false},
	{-0.08, -0.37, 0.04, 0.025, {30, 20, 18}, false},
	{0.0, MOUTH_Y, 0.34, 0.085, {74, 36, 35}, false},
	{0.0, MOUTH_Y, 0.3, 0.012, {34, 16, 16}, false},
};

/* Colours of one head. */
struct tones {
	double skin[HD_COLOURS], hair[HD_COLOURS];
	double freckles; /* 0 to 1 */
	uint32_t salt;
};

static uint32_t hash(int x, int y, uint32_t salt)
{
	uint32_t h = (uint32_t)x * 0x8da6b343u ^ (uint32_t)y * 0xd8163841u ^ salt * 0xcb1ab31fu;

	h = (h ^ h >> 15) * 0x2c1b3c6du;
	h = (h ^ h >> 12) * 0x297a2d39u;
	return h ^ h >> 15;
}

static double unit(uint32_t bits)
{
	return bits * 0x1p-32;
}

/* Smooth noise in [-1, 1] with bumps a unit apart. */
static double bumps(double x, double y, uint32_t salt)
{
	int ix = (int)floor(x), iy = (int)floor(y);
	double u = x - ix, v = y - iy;

	u = u * u * (3 - 2 * u);
	v = v * v * (3 - 2 * v);
	double low = (1 - u) * unit(hash(ix, iy, salt)) + u * unit(hash(ix + 1, iy, salt));
	double high = (1 - u) * unit(hash(ix, iy + 1, salt)) + u * unit(hash(ix + 1, iy + 1, salt));

	return 2 * ((1 - v) * low + v * high) - 1;
}

/* One in three cells of a grid has a freckle somewhere in its middle. */
static double freckle_at(double x, double y, uint32_t salt)
{
	int ix = (int)floor(x), iy = (int)floor(y);
	uint32_t bits = hash(ix, iy, salt);

	if (bits % 3)
		return 0;
	double u = x - ix - 0.35 - 0.3 * (bits >> 8 & 0xff) / 255.0;
	double v = y - iy - 0.35 - 0.3 * (bits >> 16 & 0xff) / 255.0;
	double radius = 0.15 + 0.15 * (bits >> 24) / 255.0;

	return fmax(0, 1 - (u * u + v * v) / (radius * radius));
}

static void paint_skin(const struct tones *tones, double x, double y, double colour[HD_COLOURS])
{
	double blotch = bumps(5 * x, 5 * y, tones->salt);
	double tone = 1 + 0.05 * bumps(14 * x, 14 * y, tones->salt + 1) +
		      0.05 * bumps(110 * x, 110 * y, tones->salt + 2); /* pores */
	double freckle = tones->freckles * freckle_at(26 * x, 26 * y, tones->salt + 3);

	colour[HD_RED] = tones->skin[HD_RED] * (tone + 0.05 * blotch) * (1 - 0.30 * freckle);
	colour[HD_GREEN] = tones->skin[HD_GREEN] * (tone - 0.03 * blotch) * (1 - 0.42 * freckle);
	colour[HD_BLUE] = tones->skin[HD_BLUE] * (tone - 0.03 * blotch) * (1 - 0.50 * freckle);
}

/* Strands run down from the crown. */
static void paint_hair(const struct tones *tones, double x, double y, double colour[HD_COLOURS])
{
	double strand = bumps(90 * x + 6 * y, 5 * y, tones->salt + 4);
	double lock = bumps(11 * x, 3 * y, tones->salt + 5);

	for (int k = 0; k < HD_COLOURS; k++)
		colour[k] = tones->hair[k] * (1 + 0.35 * strand + 0.2 * lock);
}

static void paint_patches(const struct tones *tones, double x, double y, double colour[HD_COLOURS])
{
	for (size_t i = 0; i < sizeof(PATCHES) / sizeof(PATCHES[0]); i++) {
		const struct patch *p = &PATCHES[i];
		double u = (x - p->x) / p->half_width, v = (y - p->y) / p->half_height;
		double share = fmin(fmax(2 * (1 - sqrt(u * u + v * v)), 0), 1); /* soft rim */

		for (int k = 0; k < HD_COLOURS; k++)
			colour[k] += share * ((p->follows_hair ? tones->hair[k] : p->colour[k]) -
					      colour[k]);
	}
}

static enum hd_part part_at(double x, double y)
{
	double v = (y - EYE_Y) / EYE_HALF_HEIGHT, u = (fabs(x) - EYE_X) / EYE_HALF_WIDTH;

	if (u * u + v * v < 1.05)
		return x > 0 ? HD_EYE_L : HD_EYE_R;
	return y < (double)MOUTH_Y && y > (double)CHIN_Y && fabs(x) < (double)MOUTH_HALF_WIDTH
		       ? HD_MOUTH
		       : HD_STILL;
}

static void paint_texel(const struct tones *tones, double x, double y, bool front, uint8_t out[4])
{
	const struct vec3 light = vec3_unit((struct vec3){0.25, 0.45, 0.85});
	double depth = sqrt(fmax(0, 1 - x * x - y * y)), colour[HD_COLOURS];
	struct vec3 normal = {x, y, front ? depth : -depth};
	double shade = 0.45 + 0.55 * fmax(0, vec3_dot(normal, light));
	double hairline = 0.66 - 0.25 * x * x + 0.02 * bumps(40 * x, 0, tones->salt + 6);
	bool hair = front ? y > hairline || fabs(x) > 0.98 - 0.1 * y : y > -0.75;

	if (hair) {
		paint_hair(tones, x, y, colour);
	} else {
		paint_skin(tones, x, y, colour);
		if (front)
			paint_patches(tones, x, y, colour);
	}
	for (int k = 0; k < HD_COLOURS; k++) /* the grain goes 8 below */
		out[k] = (uint8_t)fmin(fmax(shade * colour[k], 9), 240);
	out[HD_COLOURS] = front && !hair ? part_at(x, y) : HD_STILL;
}

static struct tones tones_of(uint64_t seed)
{
	struct tones tones;
	struct rng rng;

	rng_init(&rng, seed, 40);
	double dark = rng_uniform(&rng), fair = rng_uniform(&rng);

	for (int k = 0; k < HD_COLOURS; k++) {
		tones.skin[k] = SKIN[k] * (1 - 0.35 * dark * dark * (1 + 0.2 * k));
		tones.hair[k] = HAIR[k] * (0.8 + 1.4 * fair * fair);
	}
	tones.freckles = rng_uniform(&rng) * (1 - 0.7 * dark);
	tones.salt = rng_u32(&rng);
	return tones;
}

/* The place that hd_texel_index() takes for texel i. */
static double texel_place(int i, int side)
{
	return (i + 0.5) / (0.496 * side) - 1.008;
}

void hd_paint_init(struct hd_paint *paint, uint64_t seed)
{
	const struct tones tones = tones_of(seed);

	for (int row = 0; row < HD_PAINT_SIDE; row++)
		for (int column = 0; column < HD_PAINT_SIDE; column++)
			paint_texel(&tones, texel_place(column, HD_PAINT_SIDE),
				    texel_place(row, HD_PAINT_SIDE), true,
				    paint->face[row][column]);
	for (int row = 0; row < HD_BACK_SIDE; row++)
		for (int column = 0; column < HD_BACK_SIDE; column++)
			paint_texel(&tones, texel_place(column, HD_BACK_SIDE),
				    texel_place(row, HD_BACK_SIDE), false,
				    paint->back[row][column]);
	for (int k = 0; k < HD_COLOURS; k++)
		paint->lid[k] = (uint8_t)(0.8 * tones.skin[k]);
	paint->lid[HD_COLOURS] = HD_STILL;
}

static const uint8_t *face_texel(const struct hd_paint *paint, float x, float y)
{
	return paint->face[hd_texel_index(y, HD_PAINT_SIDE)][hd_texel_index(x, HD_PAINT_SIDE)];
}

/* The upper lid comes down over the eye, with lashes at its rim. */
static const uint8_t *look_at_eye(const struct hd_paint *paint, float closed, const uint8_t *open,
				  float y)
{
	static const uint8_t lashes[4] = {18, 13, 11, HD_STILL};
	float rim = (float)(EYE_Y + EYE_HALF_HEIGHT) - 2 * (float)EYE_HALF_HEIGHT * closed;

	if (y < rim - 0.012f)
		return open;
	return y < rim + 0.004f ? lashes : paint->lid;
}

/* Teeth above, the tongue below, dark between. `depth`: 0 at the upper lip, 1 at the lower. */
static const uint8_t *look_into_mouth(float x, float depth, float gap)
{
	static const uint8_t tooth[4] = {104, 100, 90, HD_STILL},
			     between[4] = {60, 54, 48, HD_STILL};
	static const uint8_t dark[4] = {15, 10, 10, HD_STILL}, tongue[4] = {62, 30, 30, HD_STILL};

	if (depth * gap < 0.055f) {
		float place = fabsf(x) * 22;

		return place - floorf(place) < 0.14f ? between : tooth;
	}
	return depth > 0.72f ? tongue : dark;
}

/* The lower lip and the chin move down as the lips part, less and less towards the throat. */
static const uint8_t *look_at_mouth(const struct hd_paint *paint, float gap, float x, float y)
{
	float u = x / MOUTH_HALF_WIDTH;
	float here = gap * (1 - u * u), below = MOUTH_Y - y;

	if (here <= 0)
		return face_texel(paint, x, y);
	if (below < here)
		return look_into_mouth(x, below / here, gap);
	float share = (y - CHIN_Y) / (MOUTH_Y - here - CHIN_Y);

	return face_texel(paint, x, y + here * share);
}

const uint8_t *hd_paint_live(const struct hd_paint *paint, const struct hd_mood *mood,
			     const uint8_t *texel, float x, float y)
{
	if (texel[HD_COLOURS] == HD_MOUTH)
		return look_at_mouth(paint, mood->gap, x, y);
	return look_at_eye(paint, mood->lids[texel[HD_COLOURS] == HD_EYE_R], texel, y);
}
