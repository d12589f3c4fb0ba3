/*
 * What a camera sees, spot by spot; then what the finder would err.
 */
#include "sim/blob_play.h"

#include <math.h>

#include "base/rng.h"
#include "sim/blob_play_spots.h"
#include "sim/render/lamps.h"
#include "sim/render/marker_spot.h"
#include "sim/render/optics.h"

/* Wide tails and fixed patterns make some errors larger than noise does. */
#define OUTLIER_SHARE 0.03
#define OUTLIER_GAIN 3.0
#define STRAY_RADIUS_PX 1.2
#define SPOT_MAX (BLOB_MAX + LAMP_MAX)

struct play_view {
	struct play_camera camera;
	const struct blob_play *play;
	uint32_t count, lost;
	struct play_spot spots[SPOT_MAX];
};

static void add_spot(struct play_view *view, const struct spot *spot)
{
	if (view->count == SPOT_MAX) {
		view->lost++;
		return;
	}
	bool found = play_spot_of(&view->camera, spot, &view->spots[view->count]);

	if (view->play->sigma_px > 0)
		view->spots[view->count].sigma_px = view->play->sigma_px;
	view->count += found || view->play->sigma_px > 0;
}

static void add_markers(struct play_view *view, const struct sim_scene *scene,
			const struct sim_truth *truth, uint32_t c, double brightness,
			struct rng *rng)
{
	for (uint32_t m = 0; m < truth->marker_count; m++) {
		const struct sim_truth_marker *marker = &truth->markers[m];
		double pixel[2];

		if (!(marker->visible_mask & (UINT32_C(1) << c)) ||
		    !sim_camera_project(view->camera.eye, marker->p_stage_m, pixel) ||
		    rng_uniform(rng) < view->play->lost_share)
			continue;
		struct vec3 to_camera =
			vec3_unit(vec3_sub(view->camera.eye->centre_stage_m, marker->p_stage_m));
		struct spot spot =
			marker_spot(scene, truth, c, m, pixel,
				    vec3_dot(to_camera, marker->normal_stage), brightness);

		add_spot(view, &spot);
	}
}

static void add_ghosts(struct play_view *view, const struct sim_scene *scene,
		       const struct sim_truth *truth, uint32_t c, double brightness)
{
	for (uint32_t g = 0; g < truth->ghost_count; g++) {
		double pixel[2], value;
		struct vec3 place;
		struct spot spot;

		if ((truth->ghosts[g].visible_mask & (UINT32_C(1) << c)) &&
		    scene_camera_sees_ghost(scene, truth, c, g, &place, pixel, &value) &&
		    ghost_spot(scene, truth, c, place, value, brightness, &spot))
			add_spot(view, &spot);
	}
}

static void add_lamps(struct play_view *view, const struct sim_scene *scene,
		      const struct sim_truth *truth, uint32_t c)
{
	struct spot lamps[LAMP_MAX];
	uint32_t count = lamps_find(scene, truth, c, true, lamps);

	for (uint32_t i = 0; i < count; i++)
		add_spot(view, &lamps[i]);
}

static void add_strays(struct play_view *view, struct rng *rng)
{
	for (int i = 0; i < view->play->stray_count; i++) {
		struct spot spot = {.centre_px = {rng_uniform(rng) * view->camera.eye->width_px,
						  rng_uniform(rng) * view->camera.eye->height_px},
				    .axes_px = {{STRAY_RADIUS_PX, 0}, {0, STRAY_RADIUS_PX}},
				    .brightness = 60 + 200 * rng_uniform(rng)};

		add_spot(view, &spot);
	}
}

/* Standard deviation of the error of a blob whose noise is 1, and that error. */
static double error_gain(int optics)
{
	double tail = OUTLIER_GAIN * OUTLIER_GAIN - 1;

	return optics == SIM_OPTICS_TAILED ? sqrt(1 + OUTLIER_SHARE * tail) : 1;
}

static double draw_gain(int optics, struct rng *rng)
{
	if (optics != SIM_OPTICS_TAILED)
		return 1;
	return rng_uniform(rng) < OUTLIER_SHARE ? OUTLIER_GAIN : 1;
}

static void report(const struct play_view *view, int optics, struct rng *rng, struct blob_set *set)
{
	for (uint32_t i = 0; i < view->count; i++) {
		const struct play_spot *spot = &view->spots[i];
		double gain = spot->sigma_px * draw_gain(optics, rng);
		double claimed_px = view->play->claimed_px > 0
					    ? view->play->claimed_px
					    : spot->sigma_px * error_gain(optics);
		struct blob blob = {.x_px = (float)(spot->x_px + gain * rng_normal(rng)),
				    .y_px = (float)(spot->y_px + gain * rng_normal(rng)),
				    .sigma_px = (float)claimed_px,
				    .area_px2 = (float)floor(spot->area_px2),
				    .peak = (uint16_t)spot->peak_grey,
				    .flags = (uint16_t)spot->flags};

		for (int k = 0; k < 3; k++)
			blob.shape_px2[k] = (float)spot->spread_px2[k];
		if (set->blob_count == BLOB_MAX)
			set->blobs_lost++;
		else
			set->blobs[set->blob_count++] = blob;
	}
}

void blob_play_camera(const struct blob_play *play, const struct sim_scene *scene,
		      const struct sim_truth *truth, uint64_t shot, uint32_t c,
		      struct blob_set *set)
{
	struct play_view view;
	struct rng rng;

	view.camera = play_camera_of(scene, c, truth->time_s);
	double brightness = marker_brightness(scene, c, MARKER_PEAK_GREY, view.camera.blur_px);

	view.play = play;
	view.count = view.lost = 0;
	rng_init(&rng, scene->seed + shot * UINT64_C(0x9e3779b97f4a7c15), 128 + c);
	set->shot = set->device_seq = shot;
	set->mid_exposure_ns = sim_scene_mid_exposure_ns(scene, shot);
	set->uncertainty_ns = 1000;
	set->arrival_ns = set->found_ns = 0;
	set->blob_count = 0;
	add_markers(&view, scene, truth, c, brightness, &rng);
	add_ghosts(&view, scene, truth, c, brightness);
	add_lamps(&view, scene, truth, c);
	add_strays(&view, &rng);
	view.count = play_spots_merge(view.spots, view.count, play->merge_px);
	set->blobs_lost = view.lost;
	report(&view, scene->script.optics, &rng, set);
}

void blob_play_fault(struct blob_set *set, sim_fault_mask faults)
{
	if (faults & SIM_FAULT_BIT(SIM_FAULT_DARK))
		set->blob_count = 0;
	if (!(faults & SIM_FAULT_BIT(SIM_FAULT_STUCK_EXPOSURE)))
		return;
	for (uint32_t b = 0; b < set->blob_count; b++) {
		set->blobs[b].flags |= BLOB_SATURATED;
		set->blobs[b].area_px2 *= 2;
		set->blobs[b].peak = 240;
	}
}
