/*
 * What pictures cost: 1280x1024 images per second of one core with full noise, by both models of
 * lens and sensor; and how much faster than the stage a scene runs at blob level, tracker included.
 */
#include <getopt.h>
#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "base/clock.h"
#include "base/sort.h"
#include "sim/play.h"
#include "sim/render/hd_render.h"
#include "sim/render/render.h"
#include "tests/bench/figures.h"

#define CAMERAS 8
#define ROUNDS 5
#define IMAGES 40 /* per round */
#define HD_IMAGES 20
#define BOARD_IMAGES 5
#define BLOB_SECONDS 10
#define RATE_HZ 120

static const char *const OPTICS[] = {"gaussian", "tailed"};

static double thread_s(void)
{
	struct timespec t;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static struct sim_options options_of(const char *optics, uint64_t seed)
{
	return (struct sim_options){.scene = "talking",
				    .seed = seed,
				    .camera_count = CAMERAS,
				    .rate_hz = RATE_HZ,
				    .optics = optics};
}

/* The median round's. */
static double seconds_per_image(const struct sim_scene *scene, enum sim_noise noise)
{
	double rounds_s[ROUNDS];

	for (int round = 0; round < ROUNDS; round++) {
		struct sim_renderer *renderer;
		int width_px, height_px;

		if (sim_renderer_create(&renderer, scene, (uint32_t)round, noise))
			return NAN;
		sim_render(renderer, 0, &width_px, &height_px);
		double start_s = thread_s();

		for (uint64_t image = 1; image <= IMAGES; image++)
			sim_render(renderer, 17 * image, &width_px, &height_px);
		rounds_s[round] = (thread_s() - start_s) / IMAGES;
		sim_renderer_destroy(renderer);
	}
	sort_doubles(rounds_s, ROUNDS);
	return rounds_s[ROUNDS / 2];
}

static void add(json_t *figures, const char *name, const char *optics, double value)
{
	char key[64];

	snprintf(key, sizeof(key), "%s%s%s", name, *optics ? "_" : "", optics);
	json_object_set_new(figures, key, json_real(value));
}

static int bench_images(json_t *figures, uint64_t seed)
{
	double slowest_s = 0;

	for (int kind = 0; kind < 2; kind++) {
		struct sim_options options = options_of(OPTICS[kind], seed);
		struct sim_scene *scene;

		if (sim_scene_create(&scene, &options, NULL))
			return -1;
		double full_s = seconds_per_image(scene, SIM_NOISE_FULL);

		add(figures, "render_images_per_s", OPTICS[kind], 1 / full_s);
		add(figures, "render_live_us", OPTICS[kind],
		    1e6 * seconds_per_image(scene, SIM_NOISE_FAST));
		slowest_s = fmax(slowest_s, full_s);
		sim_scene_destroy(scene);
	}
	add(figures, "render_images_per_s", "", 1 / slowest_s);
	return 0;
}

static int bench_hd_image(json_t *figures, uint64_t seed)
{
	struct sim_options options = options_of("gaussian", seed);
	struct sim_hd_renderer *renderer;
	struct sim_scene *scene;
	int width_px, height_px;

	options.hd_camera_count = 1;
	options.hd_after_ir_ns = SIM_HD_AFTER_IR_NS;
	if (sim_scene_create(&scene, &options, NULL) ||
	    sim_hd_renderer_create(&renderer, scene, CAMERAS))
		return -1;
	double start_s = thread_s();

	for (uint64_t image = 0; image < HD_IMAGES; image++)
		sim_hd_render(renderer, sim_scene_hd_shot(scene, image), &width_px, &height_px);
	add(figures, "render_hd_image_us", "", 1e6 * (thread_s() - start_s) / HD_IMAGES);
	sim_hd_renderer_destroy(renderer);
	sim_scene_destroy(scene);
	return 0;
}

static int bench_board_image(json_t *figures, uint64_t seed)
{
	struct sim_options options = options_of("gaussian", seed);
	struct sim_renderer *renderer;
	struct sim_scene *scene;
	int width_px, height_px;

	options.scene = "board";
	if (sim_scene_create(&scene, &options, NULL) ||
	    sim_renderer_create(&renderer, scene, 0, SIM_NOISE_FULL))
		return -1;
	double start_s = thread_s();

	for (uint64_t image = 0; image < BOARD_IMAGES; image++)
		sim_render(renderer, image, &width_px, &height_px);
	add(figures, "render_board_image_us", "", 1e6 * (thread_s() - start_s) / BOARD_IMAGES);
	sim_renderer_destroy(renderer);
	sim_scene_destroy(scene);
	return 0;
}

static int bench_blob_level(json_t *figures, uint64_t seed)
{
	static struct sim_play play;
	static const struct blob_play blobs = {0};
	double slowest_s = 0;

	for (int kind = 0; kind < 2; kind++) {
		struct sim_options options = options_of(OPTICS[kind], seed);

		if (sim_play_init(&play, &options, NULL))
			return -1;
		double start_s = thread_s();

		for (uint64_t shot = 0; shot < BLOB_SECONDS * RATE_HZ; shot++)
			sim_play_shot_us(&play, &blobs, shot, 0);
		slowest_s = fmax(slowest_s, thread_s() - start_s);
		sim_play_finish(&play);
	}
	add(figures, "blob_level_over_real_time", "", BLOB_SECONDS / slowest_s);
	return 0;
}

int main(int argc, char **argv)
{
	static const struct option options[] = {{"json", no_argument, NULL, 'j'},
						{"seed", required_argument, NULL, 's'},
						{"help", no_argument, NULL, 'h'},
						{0}};
	uint64_t seed = (uint64_t)clock_now_ns() % 1000000007;
	json_t *figures = json_object();
	bool json = false;
	int option;

	while ((option = getopt_long(argc, argv, "", options, NULL)) != -1) {
		if (option == 'j')
			json = true;
		else if (option == 's')
			seed = strtoull(optarg, NULL, 10);
		else {
			fprintf(stderr, "usage: bench-render [--json] [--seed N]\n");
			return option == 'h' ? 0 : 2;
		}
	}
	json_object_set_new(figures, "render_seed", json_integer((json_int_t)seed));
	int status = bench_images(figures, seed) || bench_hd_image(figures, seed) ||
		     bench_board_image(figures, seed) || bench_blob_level(figures, seed);

	print_figures(figures, json);
	return status;
}
