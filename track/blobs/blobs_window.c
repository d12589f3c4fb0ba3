/*
 * The inner loops of the centroid, eight pixels at a time.
 */
#include <math.h>

#include "track/blobs/blobs_float8.h"
#include "track/blobs/blobs_parts.h"

static inline void totals(float8 a, float8 b, float8 c, float8 d, float out[4])
{
	float8 v = simde_mm256_hadd_ps(simde_mm256_hadd_ps(a, b), simde_mm256_hadd_ps(c, d));

	simde_mm_storeu_ps(out, simde_mm_add_ps(simde_mm256_castps256_ps128(v),
						simde_mm256_extractf128_ps(v, 1)));
}

bool window_around(const struct grey_image *image, float x_px, float y_px, float half_x_px,
		   float half_y_px, struct window *out)
{
	int last = (int)floorf(x_px + half_x_px);

	out->x0 = (int)ceilf(x_px - half_x_px);
	out->x1 = out->x0 + (((int)(2 * half_x_px) + WINDOW_STEP_PX) & -WINDOW_STEP_PX);
	out->y0 = (int)ceilf(y_px - half_y_px);
	out->y1 = (int)floorf(y_px + half_y_px) + 1;
	if (out->x1 > image->width_px &&
	    last < image->width_px) { /* what is beyond has no weight */
		out->x0 -= out->x1 - image->width_px;
		out->x1 = image->width_px;
	}
	return out->x0 >= 0 && out->y0 >= 0 && out->x1 <= image->width_px &&
	       out->y1 <= image->height_px;
}

/* Sums over the window: w S, its first moments, and what slope and noise need. */
struct sums {
	float8 value, x, y, slope, noise; /* a quarter of the slope */
};

/* w(u) before the factor e, and its slope; folded away where the profile is a constant. */
static inline float8 profile_value(enum kernel_profile profile, float8 u, float8 u2)
{
	switch (profile) {
	case PROFILE_HILL:
		return all(1);
	case PROFILE_MESA:
		return add(all(1), mul(all(4), u));
	case PROFILE_RING:
		return u;
	default:
		return u2;
	}
}

/* A quarter of the slope of w(u) times u / t, less what the factor e adds. */
static inline float8 profile_fall(enum kernel_profile profile, float8 u, float8 u2, float8 t)
{
	switch (profile) {
	case PROFILE_HILL:
		return sub(all(0), u2);
	case PROFILE_MESA:
		return sub(mul(u, t), mul(add(all(1), mul(all(4), u)), u2));
	case PROFILE_RING:
		return sub(mul(mul(all(0.25f), u), t), mul(u, u2));
	default:
		return sub(mul(mul(all(0.5f), u2), t), mul(u2, u2));
	}
}

/* Integral of w2 u over u, from 0 to 1. */
static float profile_noise(enum kernel_profile profile)
{
	static const float integral[] = {0.1f, 0.662193f, 0.0166667f, 0.00476190f};

	return integral[profile];
}

/* Adds eight pixels of signal s at squared distance u; returns w s. */
static inline float8 add_pixels(struct sums *sums, enum kernel_profile profile, float8 s, float8 u,
				float8 dx)
{
	float8 u2 = mul(u, u), t = simde_mm256_max_ps(sub(all(1), u2), all(0));
	float8 st = mul(s, t), wt = mul(profile_value(profile, u, u2), t), ws = mul(wt, st);

	sums->x = add(sums->x, mul(ws, dx));
	sums->slope = add(sums->slope, mul(profile_fall(profile, u, u2, t), st));
	sums->noise = add(sums->noise, mul(mul(wt, t), mul(ws, u)));
	return ws;
}

/* What every row of the window needs of it. */
struct lines {
	float8 value, slope_x, slope_y, qxx, two_qxy, qyy, first_dx;
};

static inline struct lines lines_of(const struct fit *fit)
{
	float8 column = simde_mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);

	return (struct lines){
		.value = all(fit->background.value),
		.slope_x = all(fit->background.slope_x),
		.slope_y = all(fit->background.slope_y),
		.qxx = all(fit->kernel.qxx),
		.two_qxy = all(2 * fit->kernel.qxy),
		.qyy = all(fit->kernel.qyy),
		.first_dx = sub(column, all(fit->x_px - (float)fit->window.x0)),
	};
}

/* The window's first pixel, in the copy of the spot's surroundings when that holds all of them. */
static const grey *window_pixels(const struct grey_image *image, const struct fit *fit,
				 ptrdiff_t *stride_px)
{
	const struct patch_copy *copy = fit->copy;
	const struct window *w = &fit->window;

	if (copy->spot == fit->spot && w->x0 >= copy->x0 && w->x1 <= copy->x0 + PATCH_PX &&
	    w->y0 >= copy->y0 && w->y1 <= copy->y0 + PATCH_PX) {
		*stride_px = PATCH_PX;
		return (const grey *)(const void *)copy->pixels + (w->y0 - copy->y0) * PATCH_PX +
		       (w->x0 - copy->x0);
	}
	*stride_px = image->stride_bytes / (ptrdiff_t)sizeof(grey);
	return grey_row(image, w->y0) + w->x0;
}

/* `steps` is a constant where most windows are so narrow: what depends on x alone is then worked
 * out once. So is `flat`: most backgrounds have no slope. */
static inline __attribute__((always_inline)) void
add_window(struct sums *out, const struct grey_image *image, const struct fit *fit,
	   struct feed *feed, enum kernel_profile profile, int steps, bool flat)
{
	const struct lines l = lines_of(fit);
	ptrdiff_t stride_px;
	const grey *row = window_pixels(image, fit, &stride_px);
	struct sums sums = {all(0), all(0), all(0), all(0), all(0)};
	float8 dy = all((float)fit->window.y0 - fit->y_px);

	for (int y = fit->window.y0; y < fit->window.y1; y++, row += stride_px) {
		float8 base = flat ? l.value : add(l.value, mul(l.slope_y, dy)), dx = l.first_dx;
		float8 across = mul(l.two_qxy, dy), along = mul(mul(l.qyy, dy), dy);
		float8 row_value = all(0);

		if (y & 1)
			feed_on(feed);
		for (int i = 0; i < steps; i++, dx = add(dx, all(WINDOW_STEP_PX))) {
			float8 v = simde_mm256_cvtepi32_ps(grey_load8(row + i * WINDOW_STEP_PX));
			float8 s = flat ? v : sub(v, mul(l.slope_x, dx));
			float8 u = add(along, add(mul(l.qxx, mul(dx, dx)), mul(across, dx)));

			row_value = add(row_value, add_pixels(&sums, profile, sub(s, base), u, dx));
		}
		sums.value = add(sums.value, row_value);
		sums.y = add(sums.y, mul(row_value, dy));
		dy = add(dy, all(1));
	}
	*out = sums;
}

/* The slope of the moment by the centre is nearly the same in all directions once distances are
 * measured by u, and so is the noise: one number stands for each matrix. */
static bool solve_step(const struct sums *sums, struct fit *fit)
{
	const struct kernel *k = &fit->kernel;
	float det = k->qxx * k->qyy - k->qxy * k->qxy, spread = (k->qxx + k->qyy) / (2 * det);
	float dark = k->noise_variance * 3.14159f * profile_noise(k->profile) / sqrtf(det);
	float total[4], slope, light;

	totals(add(sums->value, mul(all(4), sums->slope)), sums->x, sums->y, sums->noise, total);
	slope = total[0];
	light = total[3] / k->electrons_per_grey;
	if (!(slope > 0))
		return false;
	fit->dx = total[1] / slope;
	fit->dy = total[2] / slope;
	fit->x_px += fit->dx;
	fit->y_px += fit->dy;
	fit->background.value +=
		fit->dx * fit->background.slope_x + fit->dy * fit->background.slope_y;
	fit->variance = spread * 0.5f * (dark + (light > 0 ? light : 0)) / (slope * slope);
	return true;
}

static inline __attribute__((always_inline)) void
add_profile(struct sums *sums, const struct grey_image *image, const struct fit *fit,
	    struct feed *feed, enum kernel_profile profile)
{
	int steps = (fit->window.x1 - fit->window.x0) / WINDOW_STEP_PX;
	bool flat = fit->background.slope_x == 0 && fit->background.slope_y == 0;

	if (steps == 1 && flat)
		add_window(sums, image, fit, feed, profile, 1, true);
	else
		add_window(sums, image, fit, feed, profile, steps, false);
}

bool window_newton(const struct grey_image *image, struct fit *fit, struct feed *feed)
{
	struct sums sums;

	switch (fit->kernel.profile) {
	case PROFILE_HILL:
		add_profile(&sums, image, fit, feed, PROFILE_HILL);
		break;
	case PROFILE_MESA:
		add_profile(&sums, image, fit, feed, PROFILE_MESA);
		break;
	case PROFILE_RING:
		add_profile(&sums, image, fit, feed, PROFILE_RING);
		break;
	default:
		add_profile(&sums, image, fit, feed, PROFILE_THIN_RING);
		break;
	}
	return solve_step(&sums, fit);
}
