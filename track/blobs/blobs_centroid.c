/*
 * One spot's centroid, sigma and flags. First the moments of (I - T) over its own pixels; then,
 * where the surroundings allow, a windowed first moment whose weights follow the spot's own size
 * and shape: within a few percent of the Cramer-Rao bound for anything from a point to a flat disc.
 */
#include <math.h>

#include "track/blobs/blobs_parts.h"

#define SIGMA_FLOOR_MOMENT_PX 0.01f /* of the plain moment, which the threshold cuts */
#define CUT_PX3 \
	0.35f /* what the cut leaves open of it, times the area: one pixel tells hardly a place */
#define CRUMB_PX2 8
#define CRUMB_GAP_PX 5
#define STEPS_MAX 4
#define STEP_SMALL_PX 0.1f

static float at_least(float v, float low)
{
	return v > low ? v : low;
}

static int value_at(const struct grey_image *image, int x, int y)
{
	int value = grey_row(image, y)[x], white = grey_white(image);

	return value < white ? value : white;
}

/* A hot pixel stands alone; optics spread even a point of light over its neighbours. */
static bool is_hot(const struct spot *spot, const struct spot_scene *scene, const struct fit *fit)
{
	const struct grey_image *image = scene->image;
	float inside = 0, around = 0;
	int count = 0;

	for (int y = spot->y0 - 1; y <= spot->y1; y++)
		for (int x = spot->x0 - 1; x <= spot->x1; x++) {
			float over;

			if (x < 0 || y < 0 || x >= image->width_px || y >= image->height_px)
				continue;
			over = (float)value_at(image, x, y) - fit->background.value;
			if (value_at(image, x, y) > spot->level)
				inside += over;
			else
				around += over;
			count++;
		}
	return around < 0.25f * inside ||
	       around < 3 * sqrtf((float)count * fit->kernel.noise_variance);
}

/* The rim of a glow stands out on one side only; a crumb of a spot's faint border, next to the
 * spot, hardly at all. */
static bool is_glow(const struct spot *spot, const struct spot_scene *scene, const struct fit *fit)
{
	float sigma = sqrtf(fit->kernel.noise_variance);
	float margin = at_least((float)scene->settings->threshold_sigma * sigma,
				(float)scene->settings->threshold_min);

	return (float)spot->peak < fit->surround + margin ||
	       (fit->clear_px < CRUMB_GAP_PX && spot->area_px2 < CRUMB_PX2 &&
		(float)(spot->peak - spot->level) < 3 * sigma);
}

/* Noise of the pixels [x0, x1) of a row above the level, each times its lever. */
static float row_noise(const struct spot_scene *scene, const struct fit *fit, int y, int x0, int x1,
		       int level)
{
	float dy = (float)y - fit->y_px, sum = 0;

	for (int x = x0; x < x1; x++) {
		float dx = (float)x - fit->x_px;
		float over = (float)value_at(scene->image, x, y) - fit->background.value;

		if (value_at(scene->image, x, y) > level)
			sum += (dx * dx + dy * dy) *
			       (fit->kernel.noise_variance +
				at_least(over, 0) / fit->kernel.electrons_per_grey);
	}
	return sum;
}

/* Variance of the (I - T) moment. */
static float moment_variance(const struct spot *spot, const struct spot_scene *scene,
			     const struct fit *fit)
{
	const struct run *runs = scene->runs;
	float sum = 0;

	for (uint32_t r = spot->first_run; r != RUN_NONE; r = runs[r].next)
		sum += row_noise(scene, fit, runs[r].y, runs[r].x0, runs[r].x1, -1);
	if (spot->first_run == RUN_NONE)
		for (int y = spot->y0; y < spot->y1; y++)
			sum += row_noise(scene, fit, y, spot->x0, spot->x1, spot->level);
	return sum / (2 * (float)spot->w * (float)spot->w);
}

static bool place_window(const struct grey_image *image, struct fit *fit)
{
	const struct kernel *k = &fit->kernel;
	float det = k->qxx * k->qyy - k->qxy * k->qxy;

	return window_around(image, fit->x_px, fit->y_px, sqrtf(k->qyy / det), sqrtf(k->qxx / det),
			     &fit->window);
}

void spot_moment(const struct spot *spot, struct fit *fit)
{
	fit->x_px = (float)spot->x0 + (float)spot->wx / (float)spot->w;
	fit->y_px = (float)spot->y0 + (float)spot->wy / (float)spot->w;
}

void spot_step(const struct spot_scene *scene, struct fit *fit)
{
	fit->windowed = fit->windowed && window_newton(scene->image, fit, scene->feed);
}

/* More steps where the start was poor. Returns false when they lead away from the spot. */
static bool settle(const struct spot *spot, const struct spot_scene *scene, struct fit *fit)
{
	if (!fit->windowed)
		return false;
	for (int i = 1; i < STEPS_MAX && fabsf(fit->dx) + fabsf(fit->dy) > STEP_SMALL_PX; i++)
		if (!place_window(scene->image, fit) ||
		    !window_newton(scene->image, fit, scene->feed))
			return false;
	return fit->x_px > (float)spot->x0 - 1 && fit->x_px < (float)spot->x1 &&
	       fit->y_px > (float)spot->y0 - 1 && fit->y_px < (float)spot->y1;
}

/* The plain moment, for spots that touch the border or a neighbour. */
static void take_moment(const struct spot *spot, const struct spot_scene *scene, struct fit *fit)
{
	float cut_px = CUT_PX3 / (float)spot->area_px2;

	spot_moment(spot, fit);
	fit->variance = moment_variance(spot, scene, fit) + cut_px * cut_px;
}

static int flags_of(const struct spot *spot, const struct grey_image *image)
{
	int flags = 0;

	if (spot->peak == grey_white(image))
		flags |= BLOB_SATURATED;
	if (spot->merged)
		flags |= BLOB_MERGED;
	if (spot->x0 == 0 || spot->y0 == 0 || spot->x1 == image->width_px ||
	    spot->y1 == image->height_px)
		flags |= BLOB_EDGE;
	return flags;
}

bool spot_finish(const struct spot *spot, const struct spot_scene *scene, struct fit *fit,
		 struct blob *out)
{
	int flags = flags_of(spot, scene->image);
	float floor_px = fit->floor_px;

	if (spot->area_px2 > scene->settings->area_max_px || is_glow(spot, scene, fit) ||
	    (spot->area_px2 < scene->settings->area_min_px && is_hot(spot, scene, fit)))
		return false;
	if ((flags & BLOB_EDGE) || !settle(spot, scene, fit)) {
		take_moment(spot, scene, fit);
		floor_px = SIGMA_FLOOR_MOMENT_PX;
	}
	if (flags & BLOB_EDGE) /* how much is cut off is not known */
		floor_px = 0.15f * (float)(spot->x1 - spot->x0 + spot->y1 - spot->y0);
	*out = (struct blob){
		.x_px = fit->x_px,
		.y_px = fit->y_px,
		.sigma_px =
			sqrtf(fit->variance + floor_px * floor_px + fit->tilt_px * fit->tilt_px),
		.area_px2 = (float)spot->area_px2,
		.peak = (uint16_t)at_least(
			((float)spot->peak - fit->background.value) / grey_unit(scene->image), 0),
		.flags = (uint16_t)flags,
		.shape_px2 = {fit->shape_px2[0], fit->shape_px2[1], fit->shape_px2[2]},
	};
	return true;
}
