/*
 * Faces: spacings, lips, speeds, the band below 4 Hz, neutral when it is asked for, 64 poses.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "sim/face/ease.h"
#include "tests/unit/sim_written.h"

#define MM 1e-3

static void make_face(struct face *face, int count, uint64_t seed)
{
	face_init(face, &(struct face_options){.marker_count = count}, seed);
}

static double mean_spacing_m(const struct face *face, double *least_m)
{
	uint32_t count = face->marker_count - 4; /* without the band */
	double sum = 0;

	*least_m = INFINITY;
	for (uint32_t i = 0; i < count; i++) {
		double nearest = INFINITY;

		for (uint32_t j = 0; j < count; j++)
			if (j != i)
				nearest = fmin(nearest, vec3_distance(face->markers[i].neutral_m,
								      face->markers[j].neutral_m));
		sum += nearest;
		*least_m = fmin(*least_m, nearest);
	}
	return sum / count;
}

static void faces_have_the_spacings_of_stages_of_their_kind(void **state)
{
	static const struct {
		int count;
		double mean_m, least_m, diameter_m;
	} kinds[] = {{35, 20.5 * MM, 11 * MM, 1.5 * MM},
		     {70, 15 * MM, 7 * MM, 1.5 * MM},
		     {182, 9.4 * MM, 6 * MM, 3.2 * MM}};
	static struct face face;

	(void)state;
	for (size_t k = 0; k < 3; k++)
		for (uint64_t seed = 0; seed < 10; seed++) {
			double least_m;

			make_face(&face, kinds[k].count, seed);
			assert_int_equal(face.marker_count, kinds[k].count + 4);
			assert_true(fabs(mean_spacing_m(&face, &least_m) - kinds[k].mean_m) <
				    0.06 * kinds[k].mean_m);
			assert_true(least_m > kinds[k].least_m);
			assert_true(face.markers[0].wanted.diameter_m == kinds[k].diameter_m);
		}
}

static void names_are_unique_and_sides_are_where_they_say(void **state)
{
	static const int counts[] = {35, 70, 182};
	static struct face face;

	(void)state;
	for (size_t k = 0; k < 3; k++) {
		make_face(&face, counts[k], 1);
		for (uint32_t m = 0; m < face.marker_count; m++) {
			const struct layout_marker *marker = &face.markers[m].wanted;

			for (uint32_t i = 0; i < m; i++)
				assert_string_not_equal(face.markers[i].wanted.name, marker->name);
			assert_true(!strstr(marker->name, "_l_") || marker->neutral_m.x > 0);
			assert_true(!strstr(marker->name, "_r_") || marker->neutral_m.x < 0);
			assert_true(vec3_dot(face.markers[m].normal, marker->neutral_m) > 0);
		}
	}
}

static void pressed_lips_bring_their_markers_to_2_4_mm(void **state)
{
	static const int counts[] = {35, 70, 182};
	double weights[BASIS_COUNT] = {[BASIS_LIP_PRESS] = 1};
	static struct face face;

	(void)state;
	for (size_t k = 0; k < 3; k++) {
		struct vec3 upper = {0, 0, 0}, lower = {0, 0, 0}, normal;

		make_face(&face, counts[k], 3);
		for (uint32_t m = 0; m < face.marker_count; m++) {
			if (strcmp(face.markers[m].wanted.name, "lip_u_1") == 0)
				upper = face_marker_place(&face, m, weights, &normal);
			if (strcmp(face.markers[m].wanted.name, "lip_d_1") == 0)
				lower = face_marker_place(&face, m, weights, &normal);
		}
		assert_true(fabs(vec3_distance(upper, lower) - 2.4 * MM) < 0.01 * MM);
		assert_true(upper.y > lower.y);
	}
}

static void sixty_four_poses_move_the_face_and_eighteen_are_phonemes(void **state)
{
	static struct face face;
	int phonemes = 0;

	(void)state;
	make_face(&face, 182, 2);
	for (int pose = 0; pose < FACE_POSE_COUNT; pose++) {
		double weights[BASIS_COUNT] = {0}, most_m = 0;
		struct vec3 normal;

		face_pose_add(pose, 1, weights);
		for (uint32_t m = 0; m < face.marker_count; m++)
			most_m = fmax(most_m,
				      vec3_distance(face_marker_place(&face, m, weights, &normal),
						    face.markers[m].neutral_m));
		assert_true(most_m > 1.5 * MM && most_m < 50 * MM);
		assert_int_equal(face_pose_find(FACE_POSES[pose].name), pose);
		phonemes += strncmp(FACE_POSES[pose].name, "phoneme_", 8) == 0;
	}
	assert_int_equal(phonemes, 18);
}

static double top_speed_m_s(const struct sim_scene *scene, double from_s, double to_s)
{
	static struct sim_truth before, after;
	const double step_s = 1e-3;
	double top_m_s = 0;

	for (double t = from_s; t < to_s; t += 0.02) {
		scene_pose_markers(scene, t, &before);
		scene_pose_markers(scene, t + step_s, &after);
		for (uint32_t m = 0; m < before.marker_count; m++)
			top_m_s = fmax(top_m_s, vec3_distance(on_head(scene, &before, m),
							      on_head(scene, &after, m)) /
							step_s);
	}
	return top_m_s;
}

static void fastest_marker_comes_to_the_speed_asked_for(void **state)
{
	static const double speeds_m_s[] = {0.2, 0.4, 0.7, 1.0};
	static const int counts[] = {35, 70, 182, 70};

	(void)state;
	for (size_t i = 0; i < 4; i++) {
		char actor[160];

		snprintf(actor, sizeof(actor), "- {name: a, face_markers: %d, face_speed_m_s: %g}",
			 counts[i], speeds_m_s[i]);
		struct sim_scene *scene = scene_written(4, 10 + i, actor, "");
		double top_m_s = top_speed_m_s(scene, 0, 30);

		assert_true(fabs(top_m_s - speeds_m_s[i]) < 0.1 * speeds_m_s[i]);
		/* and not in half a minute alone */
		assert_true(fabs(top_speed_m_s(scene, 30, 45) - speeds_m_s[i]) <
			    0.15 * speeds_m_s[i]);
		sim_scene_destroy(scene);
	}
}

#define SAMPLES 2048
#define RATE_HZ 120.0

/* Power of a marker's height on the head at a frequency, through a Hann window. */
static double power_at(const double height_m[SAMPLES], double hz)
{
	double re = 0, im = 0;

	for (int i = 0; i < SAMPLES; i++) {
		double w = 0.5 - 0.5 * cos(2 * M_PI * i / SAMPLES);

		re += w * height_m[i] * cos(2 * M_PI * hz * i / RATE_HZ);
		im += w * height_m[i] * sin(2 * M_PI * hz * i / RATE_HZ);
	}
	return re * re + im * im;
}

static double share_above_4_hz(const struct sim_scene *scene, const char *name)
{
	static struct sim_truth truth;
	static double height_m[SAMPLES];
	uint32_t label = label_named(scene, name);
	double below = 0, above = 0, mean = 0, step_hz = RATE_HZ / SAMPLES;

	for (int i = 0; i < SAMPLES; i++) {
		scene_pose_markers(scene, 5 + i / RATE_HZ, &truth);
		height_m[i] = on_head(scene, &truth, label).y;
		mean += height_m[i] / SAMPLES;
	}
	for (int i = 0; i < SAMPLES; i++)
		height_m[i] -= mean;
	for (double hz = step_hz; hz < 20; hz += step_hz)
		*(hz < 4.2 ? &below : &above) += power_at(height_m, hz);
	return above / (below + above);
}

static void speech_stays_below_4_hz(void **state)
{
	struct sim_scene *scene =
		scene_written(4, 21, "- {name: a, face_markers: 70, face_speed_m_s: 0.7}", "");

	(void)state;
	assert_true(share_above_4_hz(scene, "chin_1") < 0.01);
	assert_true(share_above_4_hz(scene, "lip_d_1") < 0.01);
	assert_true(share_above_4_hz(scene, "lip_c_l_1") < 0.01);
	assert_true(share_above_4_hz(scene, "brow_l_2") < 0.01);
	sim_scene_destroy(scene);
}

static double from_neutral_m(const struct sim_scene *scene, double time_s)
{
	static struct sim_truth truth;
	double most_m = 0;

	scene_pose_markers(scene, time_s, &truth);
	for (uint32_t m = 0; m < truth.marker_count; m++)
		most_m = fmax(most_m, vec3_distance(on_head(scene, &truth, m),
						    scene->layout.markers[m].neutral_m));
	return most_m;
}

static void takes_are_neutral_at_their_ends_when_asked_and_not_when_not(void **state)
{
	struct sim_scene *clean =
		scene_written(4, 5, "- {name: a, neutral_start_s: 1.5, neutral_end_s: 2}", "");
	struct sim_scene *none = scene_written(4, 5, "- {name: a}", "");

	(void)state;
	for (double t = 0; t < 1.5; t += 0.1) {
		assert_true(from_neutral_m(clean, t) < 1e-9);
		assert_true(from_neutral_m(none, t) > 1 * MM);
	}
	assert_true(from_neutral_m(clean, 2.6) > 1 * MM);
	for (double t = 58; t < 60; t += 0.1)
		assert_true(from_neutral_m(clean, t) < 1e-9);
	sim_scene_destroy(clean);
	sim_scene_destroy(none);
}

static void range_of_motion_comes_back_to_neutral_after_every_pose(void **state)
{
	struct sim_scene *scene = scene_written(
		4, 6, "- {name: a, performance: range_of_motion, neutral_start_s: 1}", "");
	static struct sim_truth truth;
	uint32_t chin = label_named(scene, "chin_1");

	(void)state;
	for (int pose = 0; pose <= FACE_POSE_COUNT; pose++)
		assert_true(from_neutral_m(scene, 1 + PERFORMANCE_POSE_S * pose) < 1e-9);
	scene_pose_markers(scene, 2, &truth); /* the jaw first */
	assert_true(scene->layout.markers[chin].neutral_m.y - on_head(scene, &truth, chin).y >
		    10 * MM);
	sim_scene_destroy(scene);
}

static void blinks_last_three_or_four_tenths_and_hide_the_lid(void **state)
{
	struct sim_scene *scene = scene_written(4, 7, "- {name: a}", "");
	static struct sim_truth truth;
	uint32_t lid = label_named(scene, "lid_l_1");
	int blinks = 0, tucked_shots = 0;
	bool before = false;

	(void)state;
	for (double t = 0; t < 30; t += 1 / RATE_HZ) {
		sim_scene_truth(scene, t, &truth);
		blinks += truth.markers[lid].tucked && !before;
		before = truth.markers[lid].tucked;
		tucked_shots += before;
		assert_true(!before || truth.markers[lid].visible_mask == 0);
	}
	assert_in_range(blinks, 9, 11);
	assert_in_range(tucked_shots, blinks * 8, blinks * 20); /* the deepest 70 to 160 ms */
	sim_scene_destroy(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(faces_have_the_spacings_of_stages_of_their_kind),
		cmocka_unit_test(names_are_unique_and_sides_are_where_they_say),
		cmocka_unit_test(pressed_lips_bring_their_markers_to_2_4_mm),
		cmocka_unit_test(sixty_four_poses_move_the_face_and_eighteen_are_phonemes),
		cmocka_unit_test(fastest_marker_comes_to_the_speed_asked_for),
		cmocka_unit_test(speech_stays_below_4_hz),
		cmocka_unit_test(takes_are_neutral_at_their_ends_when_asked_and_not_when_not),
		cmocka_unit_test(range_of_motion_comes_back_to_neutral_after_every_pose),
		cmocka_unit_test(blinks_last_three_or_four_tenths_and_hide_the_lid),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
