/*
 * One spot's centroid, sigma and flags. First the moments of (I - T) over its own pixels; then,
 * where the surroundings allow, a windowed first moment whose weights follow the spot's own size
 * and shape: within a few percent of the Cramer-Rao bound for anything from a point to a flat disc.
 */
#include <math.h>

#include "track/blobs_window.h"

#define SIGMA_FLOOR_PX 0.003f       /* pixel phase, lens blur that is not symmetric */
#define SIGMA_FLOOR_MOMENT_PX 0.01f /* of the plain moment, which the threshold cuts */
#define POINT_VARIANCE_PX2 0.35f    /* no spot is sharper than a pixel */
#define HOT_AREA_PX 4

static int value_at(const struct grey_image *image, int x, int y)
{
	return image->pixels[(ptrdiff_t)y * image->stride_bytes + x];
}

/* A hot pixel stands alone; optics spread even a point of light over its neighbours. */
static bool is_hot(const struct spot *spot, const struct spot_scene *scene, float background,
		   float noise_variance)
{
	const struct grey_image *image = scene->image;
	float inside = 0, around = 0;
	int count = 0;

	for (int y = spot->y0 - 1; y <= spot->y1; y++)
		for (int x = spot->x0 - 1; x <= spot->x1; x++) {
			float over;

			if (x < 0 || y < 0 || x >= image->width_px || y >= image->height_px)
				continue;
			over = (float)value_at(image, x, y) - background;
			if (over + background > (float)spot->level)
				inside += over;
			else
				around += over;
			count++;
		}
	return around < 0.25f * inside || around < 3 * sqrtf((float)count * noise_variance);
}

/* Variance of the (I - T) moment: each pixel's noise, times its lever. */
static float moment_variance(const struct spot *spot, const struct run *runs,
			     const struct spot_scene *scene, float background, float noise_variance,
			     float x_px, float y_px)
{
	float sum = 0;

	for (uint32_t r = spot->first_run; r != RUN_NONE; r = runs[r].next)
		for (int x = runs[r].x0; x < runs[r].x1; x++) {
			float dx = (float)x - x_px, dy = (float)runs[r].y - y_px;
			float over = (float)value_at(scene->image, x, runs[r].y) - background;

			sum += (dx * dx + dy * dy) *
			       (noise_variance +
				fmaxf(over, 0) / (float)scene->settings->electrons_per_grey);
		}
	return sum / (2 * (float)spot->sum * (float)spot->sum);
}

/* Kernel weights by how flat the spot is: 1 for a Gaussian, 2 for a sharp disc. `scale` is the
 * window's size over the spot's. The steps are where the neighbours' efficiencies cross. */
static float choose_rings(float flatness, float ring[3])
{
	static const struct {
		float flatness_max, scale, ring[3];
	} choices[] = {
		{1.25f, 1.9f, {1, 0, 0}},
		{1.50f, 1.8f, {1, 1, 0}},
		{1.75f, 1.8f, {0, 1, 0}},
		{9.99f, 1.6f, {0, 0, 1}},
	};
	size_t i = 0;

	while (i + 1 < sizeof(choices) / sizeof(choices[0]) && flatness > choices[i].flatness_max)
		i++;
	for (int k = 0; k < 3; k++)
		ring[k] = choices[i].ring[k];
	return choices[i].scale;
}

/* Second moments over the bright pixels' surroundings; where noise drowns them, a round spot of
 * the bright area. */
static void find_shape(const struct spot *spot, const struct spot_scene *scene,
		       const struct plane *background, float noise_variance, float x_px, float y_px,
		       struct shape *shape)
{
	float half_x = 0.5f * (float)(spot->x1 - spot->x0),
	      half_y = 0.5f * (float)(spot->y1 - spot->y0);
	float t =
		((float)spot->level - background->value) / ((float)spot->peak - background->value);
	float round = (float)spot->area_px2 / (6.2832f * -logf(fminf(fmaxf(t, 0.02f), 0.6f)));
	struct window window;
	float width, height, error;

	half_x += 1.0f + 0.5f * half_x;
	half_y += 1.0f + 0.5f * half_y;
	round = fmaxf(round, POINT_VARIANCE_PX2);
	if (window_around(scene->image, x_px, y_px, half_x, half_y, &window) &&
	    window_moments(scene->image, &window, background, x_px, y_px, shape)) {
		width = (float)(window.x1 - window.x0);
		height = (float)(window.y1 - window.y0);
		error = sqrtf(noise_variance * width * height) *
			fmaxf(width * width, height * height) / (9 * shape->flux);
		if (error < 0.4f * fminf(shape->xx, shape->yy) &&
		    shape->xx * shape->yy > 1.05f * shape->xy * shape->xy) {
			shape->xx = fmaxf(shape->xx, POINT_VARIANCE_PX2);
			shape->yy = fmaxf(shape->yy, POINT_VARIANCE_PX2);
			return;
		}
	}
	*shape = (struct shape){6.2832f * round * ((float)spot->peak - background->value), round, 0,
				round};
}

/* Fits the kernel to the shape, no wider than the clear surroundings. Returns false when that
 * leaves too little of the spot. */
static bool make_kernel(const struct spot *spot, const struct spot_scene *scene,
			const struct shape *shape, float peak, struct kernel *kernel)
{
	float det = shape->xx * shape->yy - shape->xy * shape->xy;
	float flatness = shape->flux / (6.2832f * sqrtf(det) * peak);
	float scale = choose_rings(flatness, kernel->ring);
	float widest = 0.5f * (shape->xx + shape->yy) +
		       sqrtf(0.25f * (shape->xx - shape->yy) * (shape->xx - shape->yy) +
			     shape->xy * shape->xy);
	float radius = 2 * sqrtf(scale * widest), extent;

	if (radius > scene->clear_px) {
		extent = 0.5f * (float)(spot->x1 - spot->x0 > spot->y1 - spot->y0
						? spot->x1 - spot->x0
						: spot->y1 - spot->y0);
		if (scene->clear_px < extent)
			return false;
		scale *= scene->clear_px * scene->clear_px / (radius * radius);
	}
	kernel->qxx = shape->yy / (det * scale);
	kernel->qxy = -shape->xy / (det * scale);
	kernel->qyy = shape->xx / (det * scale);
	return true;
}

/* Newton from the plain moment; it converges in one step unless the start was poor. */
static bool refine(const struct spot *spot, const struct spot_scene *scene, float noise_variance,
		   float *x_px, float *y_px, float *variance)
{
	struct plane background = level_map_plane(scene->map, *x_px, *y_px);
	struct kernel kernel = {.noise_variance = noise_variance,
				.electrons_per_grey = (float)scene->settings->electrons_per_grey};
	float x = *x_px, y = *y_px, peak = (float)spot->peak - background.value, det;
	struct newton_step step;
	struct window window;
	struct shape shape;

	find_shape(spot, scene, &background, noise_variance, x, y, &shape);
	if (!make_kernel(spot, scene, &shape, peak, &kernel))
		return false;
	det = kernel.qxx * kernel.qyy - kernel.qxy * kernel.qxy;
	for (int i = 0; i < 4; i++) {
		if (!window_around(scene->image, x, y, 2 * sqrtf(kernel.qyy / det),
				   2 * sqrtf(kernel.qxx / det), &window))
			return false;
		background = level_map_plane(scene->map, x, y);
		if (!window_newton(scene->image, &window, &background, &kernel, x, y, &step))
			return false;
		x += step.dx;
		y += step.dy;
		if (fabsf(x - *x_px) > 1 || fabsf(y - *y_px) > 1)
			return false;
		if (fabsf(step.dx) + fabsf(step.dy) < 0.1f)
			break;
	}
	*x_px = x;
	*y_px = y;
	*variance = step.variance;
	return true;
}

static int flags_of(const struct spot *spot, const struct grey_image *image)
{
	int flags = 0;

	if (spot->saturated_count)
		flags |= BLOB_SATURATED;
	if (spot->merged)
		flags |= BLOB_MERGED;
	if (spot->x0 == 0 || spot->y0 == 0 || spot->x1 == image->width_px ||
	    spot->y1 == image->height_px)
		flags |= BLOB_EDGE;
	return flags;
}

static float noise_variance_at(const struct spot_scene *scene, float background)
{
	float sigma = scene->map->noise_sigma;

	return sigma * sigma + fmaxf(background - scene->map->background_median, 0) /
				       (float)scene->settings->electrons_per_grey;
}

bool spot_measure(const struct spot *spot, const struct run *runs, const struct spot_scene *scene,
		  struct blob *out)
{
	float x = (float)((double)spot->sum_x / (double)spot->sum);
	float y = (float)((double)spot->sum_y / (double)spot->sum);
	float background = level_map_plane(scene->map, x, y).value;
	float noise_variance = noise_variance_at(scene, background), variance,
	      floor_px = SIGMA_FLOOR_PX;
	int flags = flags_of(spot, scene->image);

	if (spot->area_px2 > scene->settings->area_max_px)
		return false;
	if ((spot->area_px2 < scene->settings->area_min_px || spot->area_px2 <= HOT_AREA_PX) &&
	    is_hot(spot, scene, background, noise_variance))
		return false;
	if ((flags & BLOB_EDGE) || !refine(spot, scene, noise_variance, &x, &y, &variance)) {
		variance = moment_variance(spot, runs, scene, background, noise_variance, x, y);
		floor_px = SIGMA_FLOOR_MOMENT_PX;
	}
	if (flags & BLOB_EDGE) /* how much is cut off is not known */
		floor_px = 0.15f * (float)(spot->x1 - spot->x0 + spot->y1 - spot->y0);
	*out = (struct blob){.x_px = x,
			     .y_px = y,
			     .sigma_px = sqrtf(variance + floor_px * floor_px),
			     .area_px2 = (float)spot->area_px2,
			     .peak = (uint16_t)fmaxf((float)spot->peak - background, 0),
			     .flags = (uint16_t)flags};
	return true;
}
