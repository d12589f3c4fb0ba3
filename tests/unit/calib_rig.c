/*
 * A calibration becomes a rig that the station loads.
 */
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/file.h"
#include "calib/rig/rig_write.h"
#include "calib/rt.h"
#include "calib/solve/scale_check.h"
#include "calib_wave.h"
#include "config/rig.h"
#include "config/yaml.h"

static char dir[] = "/tmp/calib_rigXXXXXX";
static struct waved waved;
static struct solution solution;
static struct seed seed;
static struct volume volume;
static struct uncertainty uncertainty;
static struct cross_check check;

static struct rig_facts facts_of(void)
{
	return (struct rig_facts){.software = "stage test",
				  .observations = &waved.observations,
				  .solution = &solution,
				  .volume = &volume,
				  .uncertainty = &uncertainty,
				  .cross_check = &check,
				  .rt_stage_ref = pose_inverse(&waved.cameras[0].rt_cam_stage)};
}

static int calibrate(void **state)
{
	(void)state;
	const struct solve_settings settings = SOLVE_SETTINGS_DEFAULT;
	struct wave wave = {
		.ir_count = 4,
		.hd_count = 1,
		.pose_count = 40,
		.board = {.squares_x = 8, .squares_y = 6, .square_m = 0.05, .tag_part = 0.7},
		.noise_px = 0.05,
		.seed = 2};

	if (!mkdtemp(dir))
		return -1;
	wave_make(&waved, &wave);
	return wave_solve(&waved, &solution, &seed) ||
	       volume_of_poses(&volume, &solution, &waved.observations) ||
	       uncertainty_find(&uncertainty, &solution, &waved.observations, &volume) ||
	       cross_check(&check, &waved.observations, &seed, &solution, &volume, &settings, NULL);
}

static int clean_up(void **state)
{
	(void)state;
	seed_finish(&seed);
	solution_finish(&solution);
	wave_finish(&waved);
	return rmdir(dir);
}

static void remove_rig(const char *path)
{
	DIR *listing = opendir(path);
	struct dirent *entry;
	char file[600];

	assert_non_null(listing);
	while ((entry = readdir(listing))) {
		snprintf(file, sizeof(file), "%s/%s", path, entry->d_name);
		unlink(file);
	}
	closedir(listing);
	assert_int_equal(rmdir(path), 0);
}

static void the_station_loads_what_was_written(void **state)
{
	(void)state;
	struct rig_facts facts = facts_of();
	char path[64], revision[17], names[CAMERA_MAX][NAME_BYTES];
	static struct rig rig;
	struct diag diag = {0};

	snprintf(path, sizeof(path), "%s/rig", dir);
	assert_int_equal(rig_write(path, &facts, revision, &diag), 0);
	for (uint32_t c = 0; c < 5; c++)
		memcpy(names[c], waved.cameras[c].name, NAME_BYTES);
	assert_int_equal(rig_load(&rig, path, (const char(*)[NAME_BYTES])names, 5, &diag), 0);
	assert_string_equal(rig.revision, revision);
	for (uint32_t c = 0; c < 5; c++) {
		struct vec3 p = {0.03, -0.02, 1.21};
		double px[2], true_px[2];

		assert_true(sim_camera_project(&waved.cameras[c], p, true_px));
		assert_true(view_project(&rig.views[c], p, px, NULL));
		assert_float_equal(px[0], true_px[0], 2); /* camera 0's own error turns the stage */
		assert_float_equal(px[1], true_px[1], 2);
		assert_true(vec3_distance(rig.views[c].centre_stage_m,
					  waved.cameras[c].centre_stage_m) < 0.003);
	}
	rig_finish(&rig);
	remove_rig(path);
}

static void the_same_calibration_gives_the_same_bytes(void **state)
{
	(void)state;
	struct rig_facts facts = facts_of();
	char path[2][64], file[600], revision[17];
	char *text[2];
	size_t size[2];
	struct dirent *entry;

	for (int i = 0; i < 2; i++) {
		snprintf(path[i], sizeof(path[i]), "%s/rig%d", dir, i);
		assert_int_equal(rig_write(path[i], &facts, revision, NULL), 0);
	}
	DIR *listing = opendir(path[0]);
	int count = 0;
	while ((entry = readdir(listing))) {
		if (entry->d_name[0] == '.')
			continue;
		for (int i = 0; i < 2; i++) {
			snprintf(file, sizeof(file), "%s/%s", path[i], entry->d_name);
			assert_int_equal(file_read(&text[i], &size[i], file, 1 << 20, NULL), 0);
		}
		assert_int_equal(size[0], size[1]);
		assert_memory_equal(text[0], text[1], size[0]);
		free(text[0]);
		free(text[1]);
		count++;
	}
	closedir(listing);
	assert_int_equal(count, 6);
	remove_rig(path[0]);
	remove_rig(path[1]);
}

static void the_facts_are_yaml_that_says_what_it_is_worth(void **state)
{
	(void)state;
	struct rig_facts facts = facts_of();
	char path[64], file[80], revision[17], hash[OBSERVATIONS_HASH_BYTES];
	struct diag diag = {0};
	struct yaml yaml;
	char *text;
	size_t size;

	snprintf(path, sizeof(path), "%s/rig", dir);
	snprintf(file, sizeof(file), "%s/rig.yaml", path);
	assert_int_equal(rig_write(path, &facts, revision, &diag), 0);
	assert_int_equal(yaml_open(&yaml, file, 1 << 20, &diag), 0);
	yaml_close(&yaml);
	assert_int_equal(file_read(&text, &size, file, 1 << 20, NULL), 0);
	observations_hash(&waved.observations, hash);
	assert_non_null(strstr(text, hash));
	assert_non_null(strstr(text, revision));
	const char *held_out = strstr(text, "held_out_rms_px: ");
	assert_non_null(held_out);
	assert_float_equal(atof(held_out + strlen("held_out_rms_px: ")), 0.05 * M_SQRT2, 0.01);
	assert_non_null(strstr(text, "- name: hd0"));
	free(text);
	remove_rig(path);
}

/* The same cameras as the truth has them, all distances from the first `factor` times as long. */
static void make_rig_before(struct rig *before, double factor)
{
	before->camera_count = waved.camera_count;
	for (uint32_t c = 0; c < waved.camera_count; c++) {
		memcpy(before->names[c], waved.cameras[c].name, NAME_BYTES);
		before->views[c].centre_stage_m =
			vec3_scale(waved.cameras[c].centre_stage_m, factor);
	}
}

static void a_print_out_of_scale_shows_beside_the_rig_before(void **state)
{
	(void)state;
	static struct rig before;
	struct diag diag = {0};
	double factor = 0;

	make_rig_before(&before, 1);
	assert_false(scale_has_changed(&waved.observations, &solution, &before, &factor, &diag));
	make_rig_before(&before, 1 / 1.02);
	assert_true(scale_has_changed(&waved.observations, &solution, &before, &factor, &diag));
	assert_float_equal(factor, 1.02, 0.002);
	assert_non_null(strstr(diag.text, "squares are not 50.00 mm"));
	diag_finish(&diag);
	/* one camera moved: that is no scale */
	make_rig_before(&before, 1);
	before.views[1].centre_stage_m.x += 0.1;
	before.views[2].centre_stage_m.z -= 0.1;
	assert_false(scale_has_changed(&waved.observations, &solution, &before, &factor, &diag));
	assert_int_equal(diag.count, 0);
}

static void a_rig_that_is_there_is_left_alone(void **state)
{
	(void)state;
	struct rig_facts facts = facts_of();
	char path[64], revision[17];
	struct diag diag = {0};

	snprintf(path, sizeof(path), "%s/rig", dir);
	assert_int_equal(rig_write(path, &facts, revision, &diag), 0);
	assert_int_equal(rig_write(path, &facts, revision, &diag), -EEXIST);
	assert_non_null(strstr(diag.text, path));
	diag_finish(&diag);
	remove_rig(path); /* and nothing else is left: clean_up() removes the directory */
}

static void a_lens_that_cannot_be_inverted_is_refused(void **state)
{
	(void)state;
	struct rig_facts facts = facts_of();
	char path[64], revision[17];
	struct diag diag = {0};
	double kept = solution.intrinsics[4];

	solution.intrinsics[4] = -8;
	snprintf(path, sizeof(path), "%s/rig", dir);
	assert_int_equal(rig_write(path, &facts, revision, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "cannot be inverted"));
	assert_true(access(path, F_OK) < 0);
	solution.intrinsics[4] = kept;
	diag_finish(&diag);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_station_loads_what_was_written),
		cmocka_unit_test(the_same_calibration_gives_the_same_bytes),
		cmocka_unit_test(the_facts_are_yaml_that_says_what_it_is_worth),
		cmocka_unit_test(a_print_out_of_scale_shows_beside_the_rig_before),
		cmocka_unit_test(a_rig_that_is_there_is_left_alone),
		cmocka_unit_test(a_lens_that_cannot_be_inverted_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, calibrate, clean_up);
}
