/*
 * From a spot's sums to its window: where to look, how wide, with which weights. For one spot this
 * is a long chain of divisions and roots; eight side by side wait for it but once.
 */
#include <math.h>
#include <string.h>

#include "track/blobs/blobs_float8.h"
#include "track/blobs/blobs_parts.h"
#include "track/blobs/blobs_sight.h"

#define LARGE_SNR 60 /* from here on the window need not fear noise, only the pixel grid */
#define STEEP 0.04f  /* 256ths per pixel */

#define TILT_OF_SADDLE 0.40f /* measured on pairs of equal spots */
#define TILT_OF_STEP 0.6f    /* measured on spots across a sharp rim */
#define TILT_OF_GAP 0.3f     /* measured on pairs with a dark pixel between them */
#define GAP_NONE_PX 0.5f     /* from the longer half of a spot to the skirt of the next */
#define GAP_SMALL_PX 1.0f    /* beyond, there is no pull to speak of */
#define STEP_MIN 6           /* 256ths; below, a slope that the plane follows */

#define SIGMA_FLOOR_PX 0.0015f /* pixel phase, lens blur that is not symmetric */
#define SIGMA_RIM_PX 0.0045f   /* pixel phase of a clipped spot whose rim is a pixel wide */
#define RIM_MIN_PX 0.5f
#define PIXEL_GAIN 0.006f /* no sensor's pixels are alike: 0.5 to 1 % (EMVA 1288, PRNU) */
#define RIM_HEIGHT 0.6f   /* of the spot's, where its pixels count most */

#define SCALE_HILL 1.75f /* the window's size over the spot's, by its profile */
#define SCALE_HILL_BRIGHT 0.6f
#define SCALE_MESA_AND_RING 1.8f
#define SCALE_THIN_RING 1.6f
#define SCALE_CLIPPED 2.6f /* clipping makes sharp edges, which only a wide window bears */

/* What follows from a sight. */
struct outcome {
	float xx[FIT_LANES], xy[FIT_LANES], yy[FIT_LANES], tilt_px[FIT_LANES],
		noise_variance[FIT_LANES];
	float qxx[FIT_LANES], qxy[FIT_LANES], qyy[FIT_LANES], profile[FIT_LANES];
	float half_x_px[FIT_LANES], half_y_px[FIT_LANES];
	int usable; /* a bit per spot: the kernel is of use */
};

/* What the skirt of a neighbour that stands a pixel away may do: the two were not one because it
 * stays below the threshold. */
static float8 tilts_of_gap(const struct sight *sight, float8 saddle)
{
	float8 half = mul(all(0.5f), load8(sight->size_px));
	float8 gap = sub(load8(sight->clear_px), half);
	float8 none = exceeds(all(GAP_NONE_PX), gap), small = exceeds(all(GAP_SMALL_PX), gap);
	float8 alone = exceeds(all(0.5f), load8(sight->merged));
	float8 pull =
		mul(saddle, select8(none, all(TILT_OF_GAP), mul(all(2 * TILT_OF_GAP), saddle)));

	return both(both(alone, small), pull);
}

/* How far a neighbour's skirt, or the step of a rim below the spot, may pull the centroid: in
 * standard deviations of the spot's light. */
static float8 tilts(const struct sight *sight, float8 height, float unit)
{
	float8 background = load8(sight->background);
	float8 saddle = over(sub(load8(sight->level), background), height);
	float8 step =
		over(greater(sub(load8(sight->contrast), all(STEP_MIN * unit)), all(0)), height);
	float8 merged = exceeds(load8(sight->merged), all(0));

	return add(add(both(merged, mul(mul(all(TILT_OF_SADDLE), saddle), saddle)),
		       tilts_of_gap(sight, saddle)),
		   mul(all(TILT_OF_STEP), step));
}

static float8 noise_variances(const struct sight *sight, const struct spot_scene *scene)
{
	float sigma = scene->map->noise_sigma;
	float8 light =
		greater(sub(load8(sight->background), all(scene->map->background_median)), all(0));

	return add(all(sigma * sigma),
		   over(light, all((float)scene->settings->electrons_per_grey)));
}

/* The kernels, by flatness in steps of a quarter, and no wider than `clear_px` around the centre:
 * none where that leaves too little of the spot. */
static void make_kernels(const struct sight *sight, const struct shapes *shapes, float8 snr,
			 int white, struct outcome *out)
{
	const float8 f = shapes->flatness, clear = load8(sight->clear_px), one = all(1);
	float8 det = sub(mul(shapes->xx, shapes->yy), mul(shapes->xy, shapes->xy));
	float8 mean = mul(all(0.5f), add(shapes->xx, shapes->yy));
	float8 mesa = exceeds(f, all(0.25f)), ring = exceeds(f, all(0.5f));
	float8 thin = exceeds(f, all(0.75f));
	float8 clipped = exceeds(load8(sight->peak), all((float)white - 0.5f));
	float8 bright = mul(all(SCALE_HILL_BRIGHT), lesser(over(snr, all(LARGE_SNR)), one));
	float8 scale = select8(mesa, all(SCALE_MESA_AND_RING), add(all(SCALE_HILL), bright));
	float8 profile = add(add(both(mesa, one), both(ring, one)), both(thin, one));
	float8 round = exceeds(det, mul(mul(all(0.05f), mean), mean)), radius2, wide, cramped;

	scale = select8(thin, all(SCALE_THIN_RING), scale);
	scale = select8(clipped, all(SCALE_CLIPPED), scale);
	profile = select8(clipped, all(PROFILE_RING), profile);
	radius2 = mul(mul(all(4), scale),
		      add(mean, root(greater(sub(mul(mean, mean), det), all(0)))));
	wide = exceeds(radius2, mul(clear, clear));
	cramped = both(wide, exceeds(mul(all(0.5f), load8(sight->size_px)), clear));
	scale = select8(wide, mul(scale, over(mul(clear, clear), radius2)), scale);
	scale = over(one, mul(mul(all(4), det), scale));
	store8(out->qxx, mul(shapes->yy, scale));
	store8(out->qxy, mul(sub(all(0), shapes->xy), scale));
	store8(out->qyy, mul(shapes->xx, scale));
	store8(out->profile, profile);
	out->usable = simde_mm256_movemask_ps(round) & ~simde_mm256_movemask_ps(cramped);
}

/* Half the width and height of each kernel's ellipse. */
static void find_reach(struct outcome *out)
{
	float8 xx = load8(out->qxx), xy = load8(out->qxy), yy = load8(out->qyy);
	float8 det = sub(mul(xx, yy), mul(xy, xy));

	store8(out->half_x_px, root(over(yy, det)));
	store8(out->half_y_px, root(over(xx, det)));
}

static void work_out(const struct sight *sight, const struct spot_scene *scene, struct outcome *out)
{
	struct shapes shapes = spot_shapes(sight);
	float8 noise = noise_variances(sight, scene);
	float8 height = sub(load8(sight->peak), load8(sight->background));
	float8 sigma = root(mul(all(0.5f), add(shapes.xx, shapes.yy)));

	store8(out->tilt_px, mul(sigma, tilts(sight, height, grey_unit(scene->image))));
	store8(out->noise_variance, noise);
	store8(out->xx, shapes.xx);
	store8(out->xy, shapes.xy);
	store8(out->yy, shapes.yy);
	make_kernels(sight, &shapes, over(height, root(noise)), grey_white(scene->image), out);
	find_reach(out);
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

static void look_at(const struct spot *spot, const struct spot_scene *scene, struct fit *fit,
		    struct sight *sight, uint32_t i)
{
	int width = spot->x1 - spot->x0, height = spot->y1 - spot->y0;

	spot_moment(spot, fit);
	find_background(spot, scene, fit);
	sight->w[i] = (float)spot->w;
	sight->area[i] = (float)spot->area_px2;
	sight->area_xx[i] = spot->area_xx;
	sight->area_xy[i] = spot->area_xy;
	sight->area_yy[i] = spot->area_yy;
	sight->peak[i] = (float)spot->peak;
	sight->level[i] = (float)spot->level;
	sight->background[i] = fit->background.value;
	sight->contrast[i] = fit->contrast;
	sight->merged[i] = spot->merged;
	sight->size_px[i] = (float)(width > height ? width : height);
	sight->clear_px[i] = fit->clear_px;
}

/* What clipping takes from a spot's height makes its rim steep, and the pixel grid tells less of a
 * steep rim. Its width follows from how much the spot lacks to a sharp disc. */
static float clipped_floor_px(const struct spot *spot)
{
	float height = (float)(spot->peak - spot->level), area = (float)spot->area_px2;
	float rim = (area - (float)spot->w / height) / sqrtf(12.566f * area);

	rim = rim > RIM_MIN_PX ? rim : RIM_MIN_PX;
	return SIGMA_RIM_PX / (rim * rim);
}

/* What light is worth: fewer electrons than there are, the more of it there is. */
static float worth_electrons(float electrons, float height)
{
	return electrons /
	       (1 + electrons * PIXEL_GAIN * PIXEL_GAIN * RIM_HEIGHT * (height > 0 ? height : 0));
}

static void take(const struct outcome *outcome, const struct spot *spot,
		 const struct spot_scene *scene, uint32_t i, struct fit *fit)
{
	float height = (float)spot->peak - fit->background.value;

	fit->floor_px =
		spot->peak == grey_white(scene->image) ? clipped_floor_px(spot) : SIGMA_FLOOR_PX;
	fit->tilt_px = outcome->tilt_px[i];
	fit->shape_px2[0] = outcome->xx[i];
	fit->shape_px2[1] = outcome->xy[i];
	fit->shape_px2[2] = outcome->yy[i];
	fit->kernel = (struct kernel){
		.qxx = outcome->qxx[i],
		.qxy = outcome->qxy[i],
		.qyy = outcome->qyy[i],
		.profile = (enum kernel_profile)outcome->profile[i],
		.noise_variance = outcome->noise_variance[i],
		.electrons_per_grey =
			worth_electrons((float)scene->settings->electrons_per_grey, height),
	};
	fit->windowed = outcome->usable >> i & 1 &&
			window_around(scene->image, fit->x_px, fit->y_px, outcome->half_x_px[i],
				      outcome->half_y_px[i], &fit->window);
}

void spot_prepare(const struct spot_scene *scene, const struct spot *spots, struct fit fits[],
		  uint32_t count)
{
	struct sight sight;
	struct outcome outcome;

	if (count < FIT_LANES)
		memset(&sight, 0, sizeof(sight));
	for (uint32_t i = 0; i < count; i++)
		look_at(&spots[fits[i].spot], scene, &fits[i], &sight, i);
	work_out(&sight, scene, &outcome);
	for (uint32_t i = 0; i < count; i++)
		take(&outcome, &spots[fits[i].spot], scene, i, &fits[i]);
}
