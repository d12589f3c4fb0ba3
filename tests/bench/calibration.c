/*
 * bench-calibration: how good calibrations are and how long they take, against the truth and
 * against mrcal-calibrate-cameras on the same corners.
 */
#include <errno.h>
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../unit/calib_look.h"
#include "../unit/calib_wave.h"
#include "calib/solve/uncertainty.h"
#include "calibration_parts.h"
#include "calibration_tool.h"
#include "tests/bench/figures.h"

#define POSES 100
#define NOISE_PX 0.1

static const struct board BOARD = {
	.squares_x = 11, .squares_y = 8, .square_m = 0.035, .tag_part = 0.7};
static const struct board SMALL_BOARD = {
	.squares_x = 7, .squares_y = 6, .square_m = 0.055, .tag_part = 0.7};

static void die(const char *what, int err)
{
	fprintf(stderr, "bench-calibration: %s: %s\n", what, strerror(-err));
	exit(1);
}

static void put(json_t *figures, const char *name, double value)
{
	json_object_set_new(figures, name, json_real(value));
}

/* False: there is no such tool here. */
static bool against_tool(json_t *figures, const struct waved *waved,
			 const struct solution *solution)
{
	struct tool_result tool;
	double worst_m = 0;
	int err = tool_calibrate(&tool, &waved->observations);

	if (err == -ENOENT) {
		fprintf(stderr, "mrcal-calibrate-cameras is not installed (package mrcal): "
				"nothing to compare with\n");
		return false;
	}
	if (err)
		die("mrcal-calibrate-cameras failed", err);
	for (uint32_t c = 0; c < waved->camera_count; c++)
		worst_m = fmax(worst_m,
			       vec3_distance(tool.centre_m[c], solution_centre_m(solution, c)));
	put(figures, "rms_over_mrcal_tool", solution->mrcal_rms_px / tool.rms_px);
	put(figures, "camera_position_vs_mrcal_tool_mm", 1e3 * worst_m);
	put(figures, "mrcal_tool_s", tool.seconds);
	return true;
}

static void against_truth(json_t *figures, uint64_t seed, bool with_tool)
{
	const struct wave wave = {.ir_count = 8,
				  .pose_count = POSES,
				  .board = BOARD,
				  .noise_px = NOISE_PX,
				  .seed = seed};
	struct solution solution;
	struct waved waved;
	struct seed start;

	wave_make(&waved, &wave);
	int err = wave_solve(&waved, &solution, &start);
	if (err)
		die("8 IR cameras", err);
	struct wave_errors errors = wave_judge(&waved, &solution);
	put(figures, "camera_position_error_mm", errors.camera_worst_mm);
	put(figures, "volume_reprojection_rms_px", errors.volume_px);
	put(figures, "triangulation_mean_mm", errors.triangulate_mm);
	bool compared = with_tool && against_tool(figures, &waved, &solution);
	put(figures, "mrcal_tool_compared", compared);
	seed_finish(&start);
	solution_finish(&solution);
	wave_finish(&waved);
}

/* Corners of pictures: the worse of both renderers counts. */
static void look_at_pictures(json_t *figures)
{
	static const char *const OPTICS[] = {"gaussian", "tailed"};
	const struct corner_settings settings = CORNER_SETTINGS_DEFAULT;
	struct look all = {0};
	double worst_px = 0;

	for (int i = 0; i < 2; i++) {
		struct sim_scene *scene = look_scene(OPTICS[i], 4);
		struct corner_finder *finder;
		struct look look = {0};

		if (!scene)
			die("scene board", -ENOENT);
		if (corner_finder_create(&finder, &scene->board.print, &settings))
			die("corners", -ENOMEM);
		for (uint32_t c = 0; c < 4; c++)
			if (look_at(&look, finder, scene, c, 10, 37))
				die("corners", -ENOMEM);
		worst_px = fmax(worst_px, sqrt(look.sum / look.measured));
		all.seconds += look.seconds;
		all.pictures += look.pictures;
		corner_finder_destroy(finder);
		sim_scene_destroy(scene);
	}
	put(figures, "corner_rms_px", worst_px);
	put(figures, "corners_ms_per_picture", 1e3 * all.seconds / all.pictures);
}

/* Adds a small rig's points; false when its views are too few, which chance may bring. */
static bool cover_rig(uint64_t seed, uint32_t *within, uint32_t *all)
{
	const struct wave wave = {.ir_count = 4,
				  .pose_count = 24,
				  .board = SMALL_BOARD,
				  .noise_px = NOISE_PX,
				  .seed = seed};
	static struct volume volume;
	static struct uncertainty uncertainty;
	static struct vec3 off_m[VOLUME_POINT_MAX];
	struct solution solution;
	struct waved waved;
	struct seed start;

	wave_make(&waved, &wave);
	bool good = !wave_solve(&waved, &solution, &start);
	if (good) {
		wave_volume(&waved, &solution, &volume, off_m);
		if (uncertainty_find(&uncertainty, &solution, &waved.observations, &volume))
			die("uncertainty", -EDOM);
		for (uint32_t i = 0; i < volume.count; i++) {
			const double off[3] = {off_m[i].x, off_m[i].y, off_m[i].z};

			for (int axis = 0; axis < 3; axis++)
				*within +=
					off[axis] * off[axis] < uncertainty.cov_m2[i][axis][axis];
		}
		*all += 3 * volume.count;
		seed_finish(&start);
		solution_finish(&solution);
	}
	wave_finish(&waved);
	return good;
}

static void cover(json_t *figures, int rig_count)
{
	uint32_t within = 0, all = 0;

	for (uint64_t seed = 1; rig_count > 0; seed++)
		rig_count -= cover_rig(seed, &within, &all);
	/* one figure with two gates */
	put(figures, "one_sigma_coverage_least", (double)within / all);
	put(figures, "one_sigma_coverage_most", (double)within / all);
}

static int usage(int status)
{
	fprintf(stderr, "usage: bench-calibration [--json] [--rigs N] [--seed N] [--minutes N] "
			"[--no-tool]\n");
	return status;
}

int main(int argc, char **argv)
{
	static const struct option OPTIONS[] = {{"json", no_argument, NULL, 'j'},
						{"rigs", required_argument, NULL, 'r'},
						{"seed", required_argument, NULL, 's'},
						{"minutes", required_argument, NULL, 'm'},
						{"no-tool", no_argument, NULL, 'n'},
						{"help", no_argument, NULL, 'h'},
						{0}};
	json_t *figures = json_object();
	bool json = false, with_tool = true;
	int option, rig_count = 200;
	double minutes = 17;
	uint64_t seed = 1;

	while ((option = getopt_long(argc, argv, "", OPTIONS, NULL)) != -1)
		switch (option) {
		case 'j':
			json = true;
			break;
		case 'r':
			rig_count = atoi(optarg);
			break;
		case 's':
			seed = strtoull(optarg, NULL, 10);
			break;
		case 'm':
			minutes = atof(optarg);
			break;
		case 'n':
			with_tool = false;
			break;
		default:
			json_decref(figures);
			return usage(option == 'h' ? 0 : 2);
		}
	against_truth(figures, seed, with_tool);
	look_at_pictures(figures);
	int err = measure_time(figures, seed);
	if (err)
		die("8 IR and 3 HD cameras", err);
	err = measure_hd(figures, seed);
	if (err)
		die("HD pictures", err);
	err = measure_aim(figures, seed, minutes);
	if (err)
		die("bumped cameras", err);
	if (rig_count > 0)
		cover(figures, rig_count);
	print_figures(figures, json);
	return 0;
}
