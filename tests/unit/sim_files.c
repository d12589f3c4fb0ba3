/*
 * The files of a scene: models as mrcal reads them, recordings as a station reads them.
 */
#include <errno.h>
#include <ftw.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>
#include <mrcal/mrcal.h>

#include "sim/record.h"
#include "sim/world/scene_parts.h"

static char root[64];

static int make_root(void **state)
{
	(void)state;
	strcpy(root, "/tmp/stage-sim-XXXXXX");
	return mkdtemp(root) ? 0 : -1;
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *where)
{
	(void)info, (void)kind, (void)where;
	return remove(path);
}

static int remove_root(void **state)
{
	(void)state;
	return nftw(root, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}

static char *at(const char *format, ...)
{
	static char paths[4][256];
	static int next;
	char *path = paths[next++ % 4];
	va_list args;
	int length = snprintf(path, 256, "%s/", root);

	va_start(args, format);
	vsnprintf(path + length, 256 - (size_t)length, format, args);
	va_end(args);
	return path;
}

static char *contents(const char *path, size_t *size_bytes)
{
	FILE *file = fopen(path, "r");
	struct stat info;

	assert_non_null(file);
	assert_int_equal(fstat(fileno(file), &info), 0);
	char *text = calloc(1, (size_t)info.st_size + 1);

	assert_int_equal(fread(text, 1, (size_t)info.st_size, file), info.st_size);
	fclose(file);
	*size_bytes = (size_t)info.st_size;
	return text;
}

/* Rodrigues' rotation and translation, as mrcal documents `extrinsics`. */
static mrcal_point3_t to_camera(const double rt_cam_ref[6], struct vec3 p)
{
	struct pose pose = pose_from_rotation_vector(
		(struct vec3){rt_cam_ref[0], rt_cam_ref[1], rt_cam_ref[2]});

	pose.t = (struct vec3){rt_cam_ref[3], rt_cam_ref[4], rt_cam_ref[5]};
	p = pose_apply(&pose, p);
	return (mrcal_point3_t){.x = p.x, .y = p.y, .z = p.z};
}

static void check_model(const struct sim_scene *scene, uint32_t c, const struct sim_truth *truth)
{
	const char *path = at("rig-only/rig/%s.cameramodel", sim_scene_camera_name(scene, c));
	mrcal_cameramodel_t *model = mrcal_read_cameramodel_file(path);

	assert_non_null(model);
	assert_int_equal(model->imagersize[0], 1280);
	assert_int_equal(model->imagersize[1], 1024);
	for (uint32_t m = 0; m < truth->marker_count; m++) {
		mrcal_point3_t p = to_camera(model->rt_cam_ref, truth->markers[m].p_stage_m);
		mrcal_point2_t q;
		double pixel[2];

		assert_true(
			mrcal_project(&q, NULL, NULL, &p, 1, &model->lensmodel, model->intrinsics));
		assert_true(
			sim_camera_project(&scene->cameras[c], truth->markers[m].p_stage_m, pixel));
		assert_true(hypot(q.x - pixel[0], q.y - pixel[1]) < 1e-6);
	}
	mrcal_free_cameramodel(&model);
}

static void models_read_by_mrcal_project_as_the_scene_does(void **state)
{
	static struct sim_truth truth;
	static const char *const addresses[] = {"a:0", "a:1", "a:2", "a:3",
						"a:4", "a:5", "a:6", "a:7"};
	struct sim_options options = {.seed = 1, .camera_count = 8};
	struct sim_scene *scene;

	(void)state;
	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	assert_int_equal(sim_scene_write_stage(scene, at("rig-only"), addresses, NULL, NULL), 0);
	sim_scene_truth(scene, 1, &truth);
	for (uint32_t c = 0; c < 8; c++)
		check_model(scene, c, &truth);
	sim_scene_destroy(scene);
}

static const struct sim_script FACE_STAGE = {.placement = SIM_PLACEMENT_FACE};

static void cameras_look_at_the_actor_the_right_way_up(void **state)
{
	static struct sim_camera cameras[SIM_CAMERA_MAX];

	(void)state;
	sim_cameras_init(cameras, 8, &FACE_STAGE, 1);
	for (int c = 0; c < 8; c++) {
		double head[2], above[2], left[2];

		assert_true(sim_camera_project(&cameras[c], (struct vec3){0, 0, 1.2}, head));
		assert_true(sim_camera_project(&cameras[c], (struct vec3){0, 0, 1.3}, above));
		assert_true(sim_camera_project(&cameras[c], (struct vec3){-0.1, 0, 1.2}, left));
		assert_true(hypot(head[0] - 640, head[1] - 512) < 100);
		assert_true(above[1] < head[1] - 50);
		assert_true(left[0] >
			    head[0] + 30); /* the actor's left is on the picture's right */
		assert_true(cameras[c].range_m > 1.1 && cameras[c].range_m < 2.0);
	}
}

static void check_images(const char *dir, const char *camera, int shot_count)
{
	size_t size_bytes;
	char *table = contents(at("%s/%s/frames.csv", dir, camera), &size_bytes);
	char expected[256] = "shot,mid_exposure_ns,uncertainty_ns,file\n";

	for (int shot = 0; shot < shot_count; shot++)
		snprintf(expected + strlen(expected), sizeof(expected) - strlen(expected),
			 "%d,%lld,1000,%06d.pgm\n", shot, 16666667LL * shot + 8333333, shot);
	assert_string_equal(table, expected);
	free(table);
	for (int shot = 0; shot < shot_count; shot++) {
		char *image = contents(at("%s/%s/%06d.pgm", dir, camera, shot), &size_bytes);

		assert_memory_equal(image, "P5\n1280 1024\n255\n", 17);
		assert_int_equal(size_bytes, 17 + 1280 * 1024);
		free(image);
	}
}

static void check_truth_line(const char *line)
{
	json_t *shot = json_loads(line, JSON_DISABLE_EOF_CHECK, NULL);
	json_t *markers = json_object_get(shot, "markers"), *marker;
	size_t i;

	assert_non_null(shot);
	assert_int_equal(json_array_size(json_object_get(json_object_get(shot, "head"), "q")), 4);
	assert_int_equal(json_array_size(json_object_get(json_object_get(shot, "head"), "t_m")), 3);
	assert_int_equal(json_array_size(markers), 74);
	json_array_foreach(markers, i, marker)
	{
		assert_true(json_is_string(json_object_get(marker, "name")));
		assert_int_equal(json_array_size(json_object_get(marker, "p_m")), 3);
		assert_int_equal(json_array_size(json_object_get(marker, "visible")),
				 json_integer_value(json_object_get(marker, "cameras")));
	}
	json_decref(shot);
}

static const struct sim_options SHORT = {.seed = 9, .rate_hz = 60};

static void recording_holds_images_tables_and_truth(void **state)
{
	size_t size_bytes;
	struct diag diag = {0};

	(void)state;
	assert_int_equal(sim_record(&SHORT, at("one"), 3 / 60.0, NULL, NULL, &diag), 0);
	assert_int_equal(diag.count, 0);
	for (int c = 0; c < 4; c++)
		check_images("one", (const char *[]){"ir0", "ir1", "ir2", "ir3"}[c], 3);
	char *truth = contents(at("one/truth.jsonl"), &size_bytes), *line = truth;

	for (int shot = 0; shot < 3; shot++, line = strchr(line, '\n') + 1)
		check_truth_line(line);
	assert_int_equal(*line, '\0');
	free(truth);
	char *config = contents(at("one/stage.yaml"), &size_bytes);

	assert_non_null(strstr(config, "rate_hz: 60\n"));
	assert_non_null(strstr(config, "address: \"files:ir3\""));
	free(config);
	config = contents(at("one/live.yaml"), &size_bytes);
	assert_non_null(strstr(config, "trigger: sim\nsim: {scene: \"talking\", seed: "));
	assert_non_null(strstr(config, "address: \"sim:ir3\""));
	free(config);
}

static void same_seed_records_the_same_bytes(void **state)
{
	static const char *const names[] = {"ir0/000001.pgm", "ir3/000002.pgm", "truth.jsonl",
					    "layout.yaml", "rig/ir1.cameramodel"};

	(void)state;
	assert_int_equal(sim_record(&SHORT, at("two"), 3 / 60.0, NULL, NULL, NULL), 0);
	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
		size_t a_bytes, b_bytes;
		char *a = contents(at("one/%s", names[i]), &a_bytes);
		char *b = contents(at("two/%s", names[i]), &b_bytes);

		assert_int_equal(a_bytes, b_bytes);
		assert_memory_equal(a, b, a_bytes);
		free(a);
		free(b);
	}
}

static void recording_again_leaves_no_old_images(void **state)
{
	(void)state;
	assert_int_equal(sim_record(&SHORT, at("two"), 1 / 60.0, NULL, NULL, NULL), 0);
	assert_int_equal(access(at("two/ir0/000000.pgm"), F_OK), 0);
	assert_int_not_equal(access(at("two/ir0/000001.pgm"), F_OK), 0);
	assert_int_not_equal(access(at("two/truth.jsonl.part"), F_OK), 0);
}

static void foreign_directory_is_left_alone(void **state)
{
	struct diag diag = {0};
	struct stat info;

	(void)state;
	assert_int_equal(mkdir(at("mine"), 0777), 0);
	assert_int_equal(mkdir(at("mine/thesis"), 0777), 0);
	assert_int_equal(sim_record(&SHORT, at("mine"), 0.1, NULL, NULL, &diag), -EEXIST);
	assert_non_null(strstr(diag.text, at("mine")));
	assert_int_not_equal(stat(at("mine/stage.yaml"), &info), 0);
	diag_finish(&diag);
}

static void unwritable_places_are_named(void **state)
{
	struct diag diag = {0};
	FILE *file = fopen(at("plain"), "w");

	(void)state;
	fclose(file);
	assert_int_equal(sim_record(&SHORT, at("plain/take"), 0.1, NULL, NULL, &diag), -ENOTDIR);
	assert_non_null(strstr(diag.text, at("plain/take")));
	diag_finish(&diag);
	assert_int_equal(sim_record(&SHORT, at("x"), -1, NULL, NULL, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "seconds"));
	diag_finish(&diag);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(models_read_by_mrcal_project_as_the_scene_does),
		cmocka_unit_test(cameras_look_at_the_actor_the_right_way_up),
		cmocka_unit_test(recording_holds_images_tables_and_truth),
		cmocka_unit_test(same_seed_records_the_same_bytes),
		cmocka_unit_test(recording_again_leaves_no_old_images),
		cmocka_unit_test(foreign_directory_is_left_alone),
		cmocka_unit_test(unwritable_places_are_named),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_root, remove_root);
}
