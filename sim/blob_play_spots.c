/*
 * Numbers of the blurred disc that is nearest to a spot.
 */
#include "sim/blob_play_spots.h"

#include <pthread.h>
#include <stdlib.h>

#include "sim/render/noise.h"
#include "sim/render/noise_patterned.h"
#include "sim/render/optics.h"

#define ROUNDING_GREY2 (1 / 12.0)
#define PIXEL_PX2 (1 / 12.0)   /* a pixel's own spread */
#define OVER_BOUND 1.1         /* what a good centroid makes of the bound */
#define FLOOR_PX 0.003         /* what remains of the brightest */
#define CLIPPED_FLOOR_PX 0.012 /* saturated ones keep their rims alone */
#define CORE_SPREADS 1.4       /* up to 2 of these two equal ones have no saddle that is found */
#define CORE_BLURS 0.3
#define PULL 0.4        /* a window is drawn to the brighter one, beyond the mean of the light */
#define TAIL_LOST 0.22  /* of the spread between two is below the threshold */
#define TOUCHING_PX 0.1 /* error of parting two at their saddle, at its worst */

static struct bound_table bounds[2]; /* by enum sim_optics */
static pthread_once_t bounds_once = PTHREAD_ONCE_INIT;

static void make_bounds(void)
{
	bound_table_init(&bounds[SIM_OPTICS_GAUSSIAN],
			 SENSOR_READ_GREY * SENSOR_READ_GREY +
				 BOUND_BLACK_GREY / SENSOR_ELECTRONS_PER_GREY + ROUNDING_GREY2,
			 SENSOR_ELECTRONS_PER_GREY);
	bound_table_init(&bounds[SIM_OPTICS_TAILED],
			 PATTERNED_READ_GREY * PATTERNED_READ_GREY +
				 PATTERNED_ROW_GREY * PATTERNED_ROW_GREY +
				 PATTERNED_OFFSET_GREY * PATTERNED_OFFSET_GREY + ROUNDING_GREY2,
			 PATTERNED_ELECTRONS_PER_GREY);
}

struct play_camera play_camera_of(const struct sim_scene *scene, uint32_t camera, double time_s)
{
	int kind = scene->script.optics;
	double share = optics_share(scene->seed, camera);

	pthread_once(&bounds_once, make_bounds);
	return (struct play_camera){
		.eye = scene_camera_at(scene, camera, time_s),
		.kind = kind,
		.bounds = &bounds[kind],
		.blur_px = optics_sigma_px(kind, share),
		/* as if all noise were of the dark: too much for bright spots */
		.noise_gain =
			sqrt(1 + scene->script.ambient_grey / (PATTERNED_ELECTRONS_PER_GREY * 4.0)),
	};
}

/* hypot() without its care for ranges that do not occur here. */
static double root(double a, double b)
{
	return sqrt(a * a + b * b);
}

static void set_spread(const struct spot *spot, double blur_px2, double out[3])
{
	const double(*a)[2] = spot->axes_px;
	double own = blur_px2 + PIXEL_PX2;

	out[0] = (a[0][0] * a[0][0] + a[0][1] * a[0][1]) / 4 + own;
	out[1] = (a[0][0] * a[1][0] + a[0][1] * a[1][1]) / 4;
	out[2] = (a[1][0] * a[1][0] + a[1][1] * a[1][1]) / 4 + own;
}

static bool runs_over_edge(const struct sim_camera *eye, const struct play_spot *spot)
{
	return spot->x_px - spot->reach_px < -0.5 || spot->y_px - spot->reach_px < -0.5 ||
	       spot->x_px + spot->reach_px > eye->width_px - 0.5 ||
	       spot->y_px + spot->reach_px > eye->height_px - 0.5;
}

bool play_spot_of(const struct play_camera *camera, const struct spot *spot, struct play_spot *out)
{
	double defocus_px = optics_defocus_px(camera->kind, camera->eye->width_px,
					      camera->eye->height_px, spot);
	double blur_px2 = camera->blur_px * camera->blur_px + defocus_px * defocus_px / 16;
	double light = spot_light(spot), blur_px = sqrt(blur_px2 + PIXEL_PX2), middle[2];
	double radius_px = sqrt(light / (M_PI * spot->brightness));
	struct bound bound = bound_of(camera->bounds, radius_px / blur_px, spot->brightness);
	bool clipped = bound.peak_grey >= 255 - BOUND_BLACK_GREY;
	double floor_px = clipped ? CLIPPED_FLOOR_PX : FLOOR_PX;

	spot_centroid(spot, middle);
	*out = (struct play_spot){
		.x_px = middle[0],
		.y_px = middle[1],
		.sigma_px =
			root(OVER_BOUND * camera->noise_gain * (double)bound.sigma_px, floor_px),
		.light = light,
		.reach_px = (double)bound.reach_sigma * blur_px,
		.core_px = fmax(CORE_SPREADS * sqrt(blur_px * blur_px + radius_px * radius_px / 4),
				radius_px + CORE_BLURS * blur_px),
		.peak_grey = fmin((double)bound.peak_grey, 255 - BOUND_BLACK_GREY),
		.flags = clipped ? BLOB_SATURATED : 0};
	set_spread(spot, blur_px2, out->spread_px2);
	out->area_px2 = fmax(M_PI * out->reach_px * out->reach_px, 1);
	if (clipped)
		out->core_px = out->reach_px;
	out->flags |= runs_over_edge(camera->eye, out) ? BLOB_EDGE : 0;
	return bound.reach_sigma > 0;
}

static int by_row(const void *a, const void *b)
{
	const struct play_spot *one = a, *other = b;

	return (one->y_px > other->y_px) - (one->y_px < other->y_px);
}

/* The two seen as one, which the finder takes for a single spot: its sigma is a single spot's. */
static void join(struct play_spot *keep, struct play_spot *give, double distance_px)
{
	double all = keep->light + give->light, share = give->light / all;
	double pulled = fmin(fmax(share + PULL * (share - 0.5), 0), 1);
	double dx = give->x_px - keep->x_px, dy = give->y_px - keep->y_px;
	double product = (1 - TAIL_LOST) * share * (1 - share);
	double more[3] = {product * dx * dx, product * dx * dy, product * dy * dy};

	for (int i = 0; i < 3; i++)
		keep->spread_px2[i] +=
			share * (give->spread_px2[i] - keep->spread_px2[i]) + more[i];
	keep->x_px += pulled * dx;
	keep->y_px += pulled * dy;
	keep->sigma_px = fmin(keep->sigma_px, give->sigma_px);
	keep->light = all;
	keep->reach_px = fmax(keep->reach_px, give->reach_px) + 0.5 * distance_px;
	keep->area_px2 += give->area_px2;
	keep->peak_grey = fmax(keep->peak_grey, give->peak_grey);
	keep->flags |= give->flags;
	give->light = 0;
}

/* Parted at their saddle: the worse, the less of a saddle there is. */
static void doubt(struct play_spot *one, struct play_spot *other, double distance_px)
{
	double from = one->core_px + other->core_px, to = one->reach_px + other->reach_px;
	double error_px = TOUCHING_PX * (to - distance_px) / (to - from);

	one->sigma_px = root(one->sigma_px, error_px);
	other->sigma_px = root(other->sigma_px, error_px);
	one->flags |= BLOB_MERGED;
	other->flags |= BLOB_MERGED;
}

static void meet(struct play_spot *one, struct play_spot *other, double merge_px)
{
	double dx = other->x_px - one->x_px, dy = other->y_px - one->y_px;
	double core_px = merge_px > 0 ? merge_px : one->core_px + other->core_px;
	double touch_px = merge_px > 0 ? 0 : one->reach_px + other->reach_px;
	double square_px2 = dx * dx + dy * dy;

	if (square_px2 < core_px * core_px)
		join(one, other, merge_px > 0 ? merge_px : sqrt(square_px2));
	else if (square_px2 < touch_px * touch_px)
		doubt(one, other, sqrt(square_px2));
}

uint32_t play_spots_merge(struct play_spot *spots, uint32_t count, double merge_px)
{
	double widest_px = merge_px / 2;
	uint32_t kept = 0;

	for (uint32_t i = 0; i < count; i++)
		widest_px = fmax(widest_px, fmax(spots[i].reach_px, spots[i].core_px));
	qsort(spots, count, sizeof(*spots), by_row);
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t j = i + 1; spots[i].light > 0 && j < count; j++) {
			if (spots[j].y_px - spots[i].y_px > 2 * widest_px)
				break;
			if (spots[j].light > 0)
				meet(&spots[i], &spots[j], merge_px);
		}
	for (uint32_t i = 0; i < count; i++)
		if (spots[i].light > 0)
			spots[kept++] = spots[i];
	return kept;
}
