/*
 * Light is summed in a plane of floats that is zero between calls; then every lit pixel is exposed
 * with fresh noise over a frame of background noise. With SIM_NOISE_FAST that frame is a stretch of
 * a long strip of pre-made noise, and the pixels written are put back before the next picture.
 */
#include "sim/render.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "sim/noise.h"
#include "sim/scene_parts.h"
#include "sim/spot.h"

#define STRIP_FRAMES 8
#define HOT_PIXELS 4
#define PEAK_GREY 175.0 /* a nominal face marker, facing the camera at its range */
#define SPOT_PIXELS_MAX ((2 * SPOT_HALF_WIDTH_PX + 2) * (2 * SPOT_HALF_WIDTH_PX + 2))
#define NOMINAL_RADIUS_M 0.75e-3

struct hot_pixel {
	int x, y;
	float grey;
};

struct sim_renderer {
	/* set when made */
	const struct sim_scene *scene; /* borrowed */
	uint32_t camera;
	enum sim_noise mode;
	struct noise *noise;
	struct blur blur;
	double brightness; /* of a nominal marker facing the camera at its range */
	struct hot_pixel hot[HOT_PIXELS];
	size_t pixel_count;
	uint8_t *strip; /* of background noise: one frame, or STRIP_FRAMES */
	/* owned by the thread that renders */
	float *light;
	uint8_t *image; /* within strip */
	struct sim_truth truth;
	struct pixel_window windows[LABEL_MAX + HOT_PIXELS];
	uint32_t window_count;
	uint32_t *lit_place; /* pixels written over the strip, and what was there */
	uint8_t *lit_before;
	uint32_t lit_count;
};

static void set_camera(struct sim_renderer *renderer)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];
	double radius_px = NOMINAL_RADIUS_M * camera->intrinsics[0] / camera->range_m;
	struct rng rng;

	rng_init(&rng, renderer->scene->seed, 16 + renderer->camera);
	blur_init(&renderer->blur, 0.8 + 0.2 * rng_uniform(&rng));
	renderer->brightness = PEAK_GREY / spot_peak_fraction(radius_px, renderer->blur.sigma_px);
	for (int i = 0; i < HOT_PIXELS; i++) {
		renderer->hot[i].x = (int)(rng_uniform(&rng) * camera->width_px);
		renderer->hot[i].y = (int)(rng_uniform(&rng) * camera->height_px);
		renderer->hot[i].grey = (float)(30.0 + 150.0 * rng_uniform(&rng));
	}
}

/* Memory that has been touched: the thread that renders shall meet no page fault. */
static void *zeroed(size_t bytes)
{
	void *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);

	return memory ? memset(memory, 0, bytes) : NULL;
}

static int allocate(struct sim_renderer *renderer)
{
	size_t frames = renderer->mode == SIM_NOISE_FAST ? STRIP_FRAMES : 1;
	size_t lit_max = (size_t)(LABEL_MAX + HOT_PIXELS) * SPOT_PIXELS_MAX;
	struct rng rng;

	rng_init(&rng, renderer->scene->seed, 32 + renderer->camera);
	if (noise_create(&renderer->noise, 8.0 + 4.0 * rng_uniform(&rng)) != 0)
		return -ENOMEM;
	renderer->strip = zeroed(frames * renderer->pixel_count);
	renderer->light = zeroed(renderer->pixel_count * sizeof(*renderer->light));
	renderer->lit_place = zeroed(lit_max * sizeof(*renderer->lit_place));
	renderer->lit_before = zeroed(lit_max);
	if (!renderer->strip || !renderer->light || !renderer->lit_place || !renderer->lit_before)
		return -ENOMEM;
	noise_fill_background(renderer->noise, &rng, renderer->strip,
			      frames * renderer->pixel_count);
	return 0;
}

int sim_renderer_create(struct sim_renderer **out, const struct sim_scene *scene, uint32_t camera,
			enum sim_noise noise)
{
	struct sim_renderer *renderer = calloc(1, sizeof(*renderer));

	if (!renderer)
		return -ENOMEM;
	renderer->scene = scene;
	renderer->camera = camera;
	renderer->mode = noise;
	renderer->pixel_count =
		(size_t)scene->cameras[camera].width_px * (size_t)scene->cameras[camera].height_px;
	set_camera(renderer);
	if (allocate(renderer) != 0) {
		sim_renderer_destroy(renderer);
		return -ENOMEM;
	}
	*out = renderer;
	return 0;
}

void sim_renderer_destroy(struct sim_renderer *renderer)
{
	if (!renderer)
		return;
	noise_destroy(renderer->noise);
	free(renderer->strip);
	free(renderer->light);
	free(renderer->lit_place);
	free(renderer->lit_before);
	free(renderer);
}

static void take_back(struct sim_renderer *renderer)
{
	for (uint32_t i = 0; i < renderer->lit_count; i++)
		renderer->image[renderer->lit_place[i]] = renderer->lit_before[i];
	renderer->lit_count = 0;
}

static void choose_background(struct sim_renderer *renderer, struct rng *rng)
{
	if (renderer->mode == SIM_NOISE_FULL) {
		renderer->image = renderer->strip;
		renderer->lit_count = 0;
		noise_fill_background(renderer->noise, rng, renderer->image, renderer->pixel_count);
		return;
	}
	take_back(renderer);
	size_t starts = (STRIP_FRAMES - 1) * renderer->pixel_count / 64;

	renderer->image = renderer->strip + 64 * (size_t)(rng_uniform(rng) * (double)starts);
}

/* Two unit vectors in the disc's plane. */
static void disc_axes(struct vec3 normal, struct vec3 *u, struct vec3 *v)
{
	struct vec3 helper = fabs(normal.x) < 0.6 ? (struct vec3){1, 0, 0} : (struct vec3){0, 1, 0};

	*u = vec3_unit(vec3_cross(normal, helper));
	*v = vec3_cross(normal, *u);
}

/* A retroreflector dims towards grazing angles, beyond what its narrower outline takes. */
static double angle_gain(double facing)
{
	double u = fmin(fmax((facing - 0.2) / 0.44, 0.0), 1.0);

	return 0.6 + 0.4 * u * u * (3.0 - 2.0 * u);
}

static void make_spot(const struct sim_renderer *renderer, uint32_t m, const double pixel[2],
		      double facing, struct spot *spot)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];
	const struct face *face = &renderer->scene->face;
	struct vec3 p = renderer->truth.markers[m].p_stage_m, axes[2];
	double radius_m = 0.5 * face->layout.markers[m].diameter_m;
	double nearness = camera->range_m / vec3_distance(camera->centre_stage_m, p);

	disc_axes(renderer->truth.markers[m].normal_stage, &axes[0], &axes[1]);
	for (int k = 0; k < 2; k++) {
		double rim[2] = {pixel[0], pixel[1]};

		sim_camera_project(camera, vec3_add(p, vec3_scale(axes[k], radius_m)), rim);
		spot->axes_px[0][k] = rim[0] - pixel[0];
		spot->axes_px[1][k] = rim[1] - pixel[1];
	}
	memcpy(spot->centre_px, pixel, sizeof(spot->centre_px));
	spot->brightness = renderer->brightness * face->markers[m].reflectivity *
			   angle_gain(facing) * nearness * nearness;
}

static void add_light(struct sim_renderer *renderer, int width_px, int height_px)
{
	struct spot spot;
	double pixel[2], facing;

	renderer->window_count = 0;
	for (uint32_t m = 0; m < renderer->truth.marker_count; m++) {
		if (!scene_camera_sees(renderer->scene, &renderer->truth, renderer->camera, m,
				       pixel, &facing))
			continue;
		make_spot(renderer, m, pixel, facing, &spot);
		renderer->windows[renderer->window_count++] =
			spot_add(&spot, &renderer->blur, renderer->light, width_px, height_px);
	}
	for (int i = 0; i < HOT_PIXELS; i++) {
		const struct hot_pixel *hot = &renderer->hot[i];

		renderer->light[(size_t)hot->y * (size_t)width_px + (size_t)hot->x] += hot->grey;
		renderer->windows[renderer->window_count++] =
			(struct pixel_window){hot->x, hot->y, hot->x + 1, hot->y + 1};
	}
}

/* Windows may overlap: a pixel is exposed once, and its light is gone then. */
static void expose_window(struct sim_renderer *renderer, const struct pixel_window *window,
			  int width_px, struct rng *rng)
{
	for (int y = window->y0; y < window->y1; y++) {
		uint32_t place = (uint32_t)(y * width_px + window->x0);

		for (int x = window->x0; x < window->x1; x++, place++) {
			float light = renderer->light[place];

			if (light <= 0)
				continue;
			renderer->light[place] = 0;
			renderer->lit_place[renderer->lit_count] = place;
			renderer->lit_before[renderer->lit_count++] = renderer->image[place];
			renderer->image[place] = noise_expose(renderer->noise, rng, light);
		}
	}
}

const uint8_t *sim_render(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			  int *height_px)
{
	const struct sim_camera *camera = &renderer->scene->cameras[renderer->camera];
	double time_s = (double)sim_scene_mid_exposure_ns(renderer->scene, shot) * 1e-9;
	struct rng rng;

	rng_init(&rng, renderer->scene->seed + shot * UINT64_C(0x9e3779b97f4a7c15),
		 64 + renderer->camera);
	scene_pose_markers(renderer->scene, time_s, &renderer->truth);
	choose_background(renderer, &rng);
	add_light(renderer, camera->width_px, camera->height_px);
	for (uint32_t i = 0; i < renderer->window_count; i++)
		expose_window(renderer, &renderer->windows[i], camera->width_px, &rng);
	*width_px = camera->width_px;
	*height_px = camera->height_px;
	return renderer->image;
}
