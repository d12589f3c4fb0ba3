/*
 * One spot's centroid, sigma and flags. First the moments of (I - T) over its own pixels; then,
 * where the surroundings allow, a windowed first moment whose weights follow the spot's own size
 * and shape: within a few percent of the Cramer-Rao bound for anything from a point to a flat disc.
 */
#include <math.h>
#include <string.h>

#include "track/blobs/blobs_parts.h"

#define SIGMA_FLOOR_PX 0.0015f /* pixel phase, lens blur that is not symmetric */
#define SIGMA_RIM_PX 0.0045f   /* pixel phase of a clipped spot whose rim is a pixel wide */
#define RIM_MIN_PX 0.5f
#define PIXEL_GAIN 0.006f           /* no sensor's pixels are alike: 0.5 to 1 % (EMVA 1288, PRNU) */
#define RIM_HEIGHT 0.6f             /* of the spot's, where its pixels count most */
#define SIGMA_FLOOR_MOMENT_PX 0.01f /* of the plain moment, which the threshold cuts */
#define POINT_VARIANCE_PX2 0.6f     /* no spot is sharper than a pixel */
#define SHAPELESS_AREA_PX2 6
#define LARGE_SNR 60 /* from here on the window need not fear noise, only the pixel grid */
#define STEEP 0.04f  /* 256ths per pixel */
#define CRUMB_PX2 8
#define CRUMB_GAP_PX 5
#define TILT_OF_SADDLE 0.40f /* measured on pairs of equal spots */
#define TILT_OF_STEP 0.6f    /* measured on spots across a sharp rim */
#define STEP_MIN 6           /* 256ths; below, a slope that the plane follows */
#define STEPS_MAX 4
#define STEP_SMALL_PX 0.1f

static float at_least(float v, float low)
{
	return v > low ? v : low;
}

static float at_most(float v, float high)
{
	return v < high ? v : high;
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

/* To seven digits, for 0 < v <= 1; the library's differs between processors. v = m 2^e with m from
 * 3/4 to 3/2; ln m = 2 artanh((m - 1) / (m + 1)). */
static float natural_log(float v)
{
	uint32_t bits, above;
	float m, t, t2;

	memcpy(&bits, &v, sizeof(bits));
	above = (bits - 0x3f400000u) & 0xff800000u;
	bits -= above;
	memcpy(&m, &bits, sizeof(m));
	t = (m - 1) / (m + 1);
	t2 = t * t;
	return (float)((int32_t)above >> 23) * 0.69314718f +
	       2 * t * (1 + t2 * (1 / 3.0f + t2 * (0.2f + t2 * (1 / 7.0f + t2 * (1 / 9.0f)))));
}

/* What a spot looks like. */
struct shape {
	float xx, xy, yy; /* second central moments, px2 */
	float flatness;   /* 0 for a Gaussian, 1 for a sharp disc */
};

/* From the area above the threshold and the mean height over it. A Gaussian cut off low down is a
 * cone with a wide skirt, a disc is the same at every height; between the two the mean height
 * tells. What is cut off is `cut` times the height, at sqrt(2 `depth`) standard deviations. */
static void find_shape(const struct spot *spot, float background, struct shape *out)
{
	float height = (float)(spot->peak - spot->level), area = (float)spot->area_px2;
	float cut = at_least(1 - height / ((float)spot->peak - background), 0.02f);
	float depth = -natural_log(cut), kept = 1 - cut;
	float mean_of_gauss = (kept - cut * depth) / (depth * kept);
	float fill = ((float)spot->w / (area * height) - mean_of_gauss) / (1 - mean_of_gauss);
	float hollow = 1 - at_most(at_least(fill, 0), 1), grow;

	out->flatness = 1 - hollow * hollow * sqrtf(hollow);
	out->flatness *= at_most(at_least((area - 4) / 16, 0), 1);
	grow = 0.83f * ((1 - out->flatness) * 2 / depth + out->flatness);
	out->xx = spot->area_xx * grow;
	out->xy = spot->area_xy * grow;
	out->yy = spot->area_yy * grow;
	if (area < SHAPELESS_AREA_PX2) {
		out->xx = out->yy = area / (6.2832f * depth);
		out->xy = 0;
	}
	out->xx = at_least(out->xx, POINT_VARIANCE_PX2);
	out->yy = at_least(out->yy, POINT_VARIANCE_PX2);
}

/* The kernel for a shape, no wider than `clear_px` around the centre. Returns false when that
 * leaves too little of the spot. */
static bool make_kernel(const struct spot *spot, const struct shape *shape, float clear_px,
			float snr, int white, struct kernel *kernel)
{
	/* By flatness, in steps of a quarter; the window's size over the spot's. */
	static const float scales[] = {1.75f, 1.8f, 1.8f, 1.6f};
	const float f = shape->flatness;
	int i = (f > 0.25f) + (f > 0.5f) + (f > 0.75f);
	float det = shape->xx * shape->yy - shape->xy * shape->xy;
	float mean = 0.5f * (shape->xx + shape->yy), scale = scales[i], radius2;
	int width = spot->x1 - spot->x0, height = spot->y1 - spot->y0;

	if (!(det > 0.05f * mean * mean))
		return false;
	if (i == PROFILE_HILL)
		scale += 0.6f * at_most(snr / LARGE_SNR, 1);
	if (spot->peak == white) { /* clipping makes sharp edges, which only a wide window bears */
		i = PROFILE_RING;
		scale = 2.6f;
	}
	radius2 = 4 * scale * (mean + sqrtf(at_least(mean * mean - det, 0)));
	if (radius2 > clear_px * clear_px) {
		if (clear_px < 0.5f * (float)(width > height ? width : height))
			return false;
		scale *= clear_px * clear_px / radius2;
	}
	scale = 1 / (4 * det * scale);
	kernel->qxx = shape->yy * scale;
	kernel->qxy = -shape->xy * scale;
	kernel->qyy = shape->xx * scale;
	kernel->profile = (enum kernel_profile)i;
	return true;
}

static float noise_variance_at(const struct spot_scene *scene, float background)
{
	float sigma = scene->map->noise_sigma;

	return sigma * sigma + at_least(background - scene->map->background_median, 0) /
				       (float)scene->settings->electrons_per_grey;
}

static bool place_window(const struct grey_image *image, struct fit *fit)
{
	const struct kernel *k = &fit->kernel;
	float det = k->qxx * k->qyy - k->qxy * k->qxy;

	return window_around(image, fit->x_px, fit->y_px, sqrtf(k->qyy / det), sqrtf(k->qxx / det),
			     &fit->window);
}

/* Where the level map is steep it is also coarse: there the ring around the spot tells. */
static void find_background(const struct spot *spot, const struct spot_scene *scene,
			    struct fit *fit)
{
	struct plane plane = level_map_plane(scene->map, fit->x_px, fit->y_px);
	float middle_x = 0.5f * (float)(spot->x0 + spot->x1 - 1);
	float middle_y = 0.5f * (float)(spot->y0 + spot->y1 - 1);

	fit->surround = fit->contrast = 0;
	if (fabsf(plane.slope_x) + fabsf(plane.slope_y) > STEEP * grey_unit(scene->image) &&
	    ring_background(scene->image, spot, &plane, &fit->surround, &fit->contrast))
		plane.value += (fit->x_px - middle_x) * plane.slope_x +
			       (fit->y_px - middle_y) * plane.slope_y;
	fit->background = plane;
}

/* How far a merged neighbour's skirt, or the step of a rim below the spot, may pull the centroid:
 * in standard deviations of the spot's light. */
static float tilt_of(const struct spot *spot, const struct fit *fit, float height, float unit)
{
	float saddle = ((float)spot->level - fit->background.value) / height;
	float step = at_least(fit->contrast - STEP_MIN * unit, 0) / height;

	return (spot->merged ? TILT_OF_SADDLE * saddle * saddle : 0) + TILT_OF_STEP * step;
}

/* What clipping takes from a spot's height makes its rim steep, and the pixel grid tells less of a
 * steep rim. Its width follows from how much the spot lacks to a sharp disc. */
static float clipped_floor_px(const struct spot *spot)
{
	float height = (float)(spot->peak - spot->level), area = (float)spot->area_px2;
	float rim = at_least((area - (float)spot->w / height) / sqrtf(12.566f * area), RIM_MIN_PX);

	return SIGMA_RIM_PX / (rim * rim);
}

void spot_prepare(const struct spot *spot, const struct spot_scene *scene, float clear_px,
		  struct fit *out)
{
	float height, electrons = (float)scene->settings->electrons_per_grey;
	struct shape shape;

	out->x_px = (float)spot->x0 + (float)spot->wx / (float)spot->w;
	out->y_px = (float)spot->y0 + (float)spot->wy / (float)spot->w;
	out->clear_px = clear_px;
	find_background(spot, scene, out);
	out->kernel.noise_variance = noise_variance_at(scene, out->background.value);
	height = (float)spot->peak - out->background.value;
	out->kernel.electrons_per_grey = electrons / (1 + electrons * PIXEL_GAIN * PIXEL_GAIN *
								  RIM_HEIGHT * at_least(height, 0));
	find_shape(spot, out->background.value, &shape);
	out->tilt_px = sqrtf(0.5f * (shape.xx + shape.yy)) *
		       tilt_of(spot, out, height, grey_unit(scene->image));
	out->floor_px =
		spot->peak == grey_white(scene->image) ? clipped_floor_px(spot) : SIGMA_FLOOR_PX;
	out->shape_px2[0] = shape.xx;
	out->shape_px2[1] = shape.xy;
	out->shape_px2[2] = shape.yy;
	out->windowed =
		make_kernel(spot, &shape, clear_px, height / sqrtf(out->kernel.noise_variance),
			    grey_white(scene->image), &out->kernel) &&
		place_window(scene->image, out);
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
	fit->x_px = (float)spot->x0 + (float)spot->wx / (float)spot->w;
	fit->y_px = (float)spot->y0 + (float)spot->wy / (float)spot->w;
	fit->variance = moment_variance(spot, scene, fit);
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
