/*
 * A marker that stands still before four cameras, from pixels on: pictures of its spot with read
 * and photon noise, the blob finder, triangulation. The Allan deviation tells what averaging gains:
 * with white noise it falls with the square root of the time (Allan 1966).
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "tests/bench/points.h"
#include "tests/bench/points_rig.h"
#include "tests/unit/track_blobs_spots.h"
#include "track/match/triangulate.h"

#define CAMERAS 4
#define RATE_HZ 120.0
#define SHOTS_QUICK 1024
#define SHOTS_MAX 8192
#define WINDOW_PX 64
#define READ_NOISE 2
#define BACKGROUND 10

/* One camera's window of pixels around the spot. */
struct window {
	struct picture picture;
	int x0, y0;
	struct blob_finder *finder;
};

static void open_window(struct window *window, const struct rig_camera *camera, struct vec3 p)
{
	struct blob_settings settings = blob_settings_default();
	double pixel[2];

	rig_camera_project(camera, p, pixel);
	window->x0 = (int)pixel[0] - WINDOW_PX / 2;
	window->y0 = (int)pixel[1] - WINDOW_PX / 2;
	window->picture = picture_create(WINDOW_PX, WINDOW_PX, BACKGROUND);
	if (blob_finder_create(&window->finder, WINDOW_PX, WINDOW_PX, &settings))
		exit(1);
	struct true_spot spot = {.x_px = pixel[0] - window->x0,
				 .y_px = pixel[1] - window->y0,
				 .diameter_px = 4,
				 .axis_ratio = 1,
				 .psf_px = 0.8,
				 .amplitude = 150};

	picture_add(&window->picture, &spot, READ_NOISE);
}

static void close_window(struct window *window)
{
	blob_finder_destroy(window->finder);
	picture_destroy(&window->picture);
}

/* False when the blob finder saw anything but one blob. */
static bool look(struct window *window, const struct view *view, struct rng *rng,
		 struct sighting *out)
{
	static struct blob_set set;

	picture_expose(&window->picture, READ_NOISE, rng);
	struct grey_image image = picture_image(&window->picture);
	blob_finder_run(window->finder, &image, &set);
	const struct blob *blob = &set.blobs[0];
	*out = (struct sighting){
		.view = view,
		.pixel = {(double)blob->x_px + window->x0, (double)blob->y_px + window->y0},
		.sigma_px = (double)blob->sigma_px,
		.flags = blob->flags};
	return set.blob_count == 1;
}

/* Returns how many of the shots gave a place. */
static int watch(const struct random_rig *rig, struct vec3 p, struct rng *rng, int shots,
		 struct vec3 *places)
{
	struct window windows[CAMERAS];
	int count = 0;

	for (int c = 0; c < CAMERAS; c++)
		open_window(&windows[c], &rig->cameras[c], p);
	for (int n = 0; n < shots; n++) {
		struct sighting sightings[CAMERAS];
		bool seen = true;
		struct fix fix;

		for (int c = 0; c < CAMERAS; c++)
			seen &= look(&windows[c], &rig->views[c], rng, &sightings[c]);
		if (seen && !triangulate(sightings, CAMERAS, &p, &fix))
			places[count++] = fix.p_stage_m;
	}
	for (int c = 0; c < CAMERAS; c++)
		close_window(&windows[c]);
	return count;
}

static struct vec3 mean(const struct vec3 *places, int count)
{
	struct vec3 sum = {0, 0, 0};

	for (int i = 0; i < count; i++)
		sum = vec3_add(sum, places[i]);
	return vec3_scale(sum, 1.0 / count);
}

/* Of means over `length` shots, root mean square over the axes, micrometres. */
static double allan_um(const struct vec3 *places, int count, int length)
{
	int pairs = count / length - 1;
	double sum_m2 = 0;

	for (int i = 0; i < pairs; i++) {
		struct vec3 a = mean(places + (size_t)i * (size_t)length, length);
		struct vec3 b = mean(places + (size_t)(i + 1) * (size_t)length, length);

		sum_m2 += vec3_dot(vec3_sub(b, a), vec3_sub(b, a));
	}
	return 1e6 * sqrt(sum_m2 / 6 / pairs);
}

void bench_still(struct points_bench *bench)
{
	static struct vec3 places[SHOTS_MAX];
	static struct random_rig rig;
	struct rng rng;
	json_t *deviations = json_object();

	rng_init(&rng, bench->seed, 60);
	random_rig_init(&rig, &rng, CAMERAS, 0.15);
	struct vec3 p = random_in_ball(&rng, 0.05);
	int count = watch(&rig, p, &rng, bench->effort > 1 ? SHOTS_MAX : SHOTS_QUICK, places);
	for (int length = 1; length * 8 <= count; length *= 4) {
		char seconds[16];

		snprintf(seconds, sizeof(seconds), "%.3g", length / RATE_HZ);
		json_object_set_new(deviations, seconds,
				    json_real(allan_um(places, count, length)));
	}
	json_object_set_new(bench->figures, "allan_um_by_seconds", deviations);
	if (count > 0)
		json_object_set_new(bench->figures, "still_marker_off_um",
				    json_real(1e6 * vec3_distance(mean(places, count), p)));
	random_rig_finish(&rig);
}
