/*
 * The simulated actor is what it claims to be: size, spacing, speed, who sees what.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "sim/world/scene_parts.h"

#define MM 1e-3

static struct sim_scene *make(const char *name, uint64_t seed, uint32_t camera_count)
{
	struct sim_options options = {.scene = name, .seed = seed, .camera_count = camera_count};
	struct sim_scene *scene = NULL;

	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	return scene;
}

static double nearest_neighbour_m(const struct layout *layout, uint32_t m)
{
	double nearest = INFINITY;

	for (uint32_t i = 0; i < layout->marker_count; i++)
		if (i != m && !layout->markers[i].rigid)
			nearest = fmin(nearest, vec3_distance(layout->markers[i].neutral_m,
							      layout->markers[m].neutral_m));
	return nearest;
}

static void seventy_face_markers_are_fifteen_millimetres_apart(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 20; seed++) {
		struct sim_scene *scene = make("rest", seed, 4);
		const struct layout *layout = sim_scene_layout(scene);
		double sum = 0, least = INFINITY;
		int count = 0;

		for (uint32_t m = 0; m < layout->marker_count; m++) {
			if (layout->markers[m].rigid)
				continue;
			double nearest = nearest_neighbour_m(layout, m);

			sum += nearest;
			least = fmin(least, nearest);
			count++;
		}
		assert_int_equal(count, 70);
		assert_true(fabs(sum / count - 15 * MM) < 1 * MM);
		assert_true(least >= 7 * MM);
		sim_scene_destroy(scene);
	}
}

static void marker_names_are_unique_and_flat_discs_lie_on_a_head(void **state)
{
	struct sim_scene *scene = make("rest", 1, 4);
	const struct layout *layout = sim_scene_layout(scene);

	(void)state;
	for (uint32_t m = 0; m < layout->marker_count; m++) {
		const struct layout_marker *marker = &layout->markers[m];

		for (uint32_t i = 0; i < m; i++)
			assert_string_not_equal(layout->markers[i].name, marker->name);
		assert_true(fabs(marker->neutral_m.x) < 80 * MM);
		assert_true(fabs(marker->neutral_m.y) < 140 * MM);
		assert_true(marker->neutral_m.z > 20 * MM && marker->neutral_m.z < 135 * MM);
		assert_true(fabs(vec3_norm(scene->actors[0].face.markers[m].normal) - 1) < 1e-9);
		assert_true(vec3_dot(scene->actors[0].face.markers[m].normal, marker->neutral_m) >
			    0);
		if (strstr(marker->name, "_l_"))
			assert_true(marker->neutral_m.x > 0);
		if (strstr(marker->name, "_r_"))
			assert_true(marker->neutral_m.x < 0);
	}
	sim_scene_destroy(scene);
}

/* A pair whose distance changes by d under a wrong naming costs at least d^2 / 2 of squared error,
 * whatever the rotation, mirrored or not. */
static double wrong_naming_rms_m(const struct vec3 p[4], const int name[4])
{
	double worst = 0;

	for (int i = 0; i < 4; i++)
		for (int j = 0; j < i; j++)
			worst = fmax(worst, fabs(vec3_distance(p[i], p[j]) -
						 vec3_distance(p[name[i]], p[name[j]])));
	return sqrt(0.5 * worst * worst / 4);
}

static void head_band_fits_in_one_way_only(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 20; seed++) {
		struct sim_scene *scene = make("rest", seed, 4);
		const struct layout *layout = sim_scene_layout(scene);
		struct vec3 p[4];
		int found = 0;

		for (uint32_t m = 0; m < layout->marker_count; m++)
			if (layout->markers[m].rigid && found < 4)
				p[found++] = layout->markers[m].neutral_m;
		assert_int_equal(found, 4);
		for (int code = 0; code < 256; code++) {
			int name[4] = {code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6};
			int used = 1 << name[0] | 1 << name[1] | 1 << name[2] | 1 << name[3];

			if (used != 15 || code == (0 | 1 << 2 | 2 << 4 | 3 << 6))
				continue;
			assert_true(wrong_naming_rms_m(p, name) > 4 * MM);
		}
		/* far from a plane: the mirrored set does not fit with the right names either */
		struct vec3 normal =
			vec3_unit(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[3], p[0])));
		assert_true(fabs(vec3_dot(normal, vec3_sub(p[2], p[0]))) > 10 * MM);
		sim_scene_destroy(scene);
	}
}

struct speeds {
	double face_m_s, band_m_s;
};

static struct speeds top_speeds(const struct sim_scene *scene)
{
	static struct sim_truth before, after;
	struct speeds top = {0, 0};
	double step_s = 1e-3;

	for (double t = 0.4; t < 20; t += 0.02) {
		scene_pose_markers(scene, t, &before);
		scene_pose_markers(scene, t + step_s, &after);
		struct pose back = pose_inverse(&before.actors[0].rt_stage_head);
		struct pose back_after = pose_inverse(&after.actors[0].rt_stage_head);

		for (uint32_t m = 0; m < before.marker_count; m++) {
			struct vec3 a = before.markers[m].p_stage_m, b = after.markers[m].p_stage_m;
			double on_head =
				vec3_distance(pose_apply(&back, a), pose_apply(&back_after, b));

			top.face_m_s = fmax(top.face_m_s, on_head / step_s);
			if (scene->layout.markers[m].rigid)
				top.band_m_s = fmax(top.band_m_s, vec3_distance(a, b) / step_s);
		}
	}
	return top;
}

static void talking_face_moves_as_fast_as_speech(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 5; seed++) {
		struct sim_scene *scene = make("talking", seed, 4);
		struct speeds top = top_speeds(scene);

		assert_true(top.face_m_s > 0.17 && top.face_m_s < 0.45);
		assert_true(top.band_m_s > 0.3 && top.band_m_s < 0.8);
		sim_scene_destroy(scene);
	}
}

static void resting_face_does_not_move(void **state)
{
	static struct sim_truth first, later;
	struct sim_scene *scene = make("rest", 3, 4);

	(void)state;
	sim_scene_truth(scene, 0, &first);
	sim_scene_truth(scene, 7.3, &later);
	first.time_s = later.time_s;
	assert_memory_equal(&first, &later, sizeof(first));
	sim_scene_destroy(scene);
}

static void turning_head_turns_sixty_degrees(void **state)
{
	static struct sim_truth truth;
	struct sim_scene *scene = make("turning", 1, 8);
	double least = 0, most = 0;

	(void)state;
	for (double t = 0; t < 15; t += 0.05) {
		scene_pose_markers(scene, t, &truth);
		double yaw = atan2(-truth.actors[0].rt_stage_head.r[0][2],
				   truth.actors[0].rt_stage_head.r[1][2]);

		least = fmin(least, yaw);
		most = fmax(most, yaw);
	}
	assert_true(most > 55 * M_PI / 180 && least < -55 * M_PI / 180);
	sim_scene_destroy(scene);
}

static void head_band_does_not_move_with_the_skin(void **state)
{
	static struct sim_truth truth;
	struct sim_scene *scene = make("talking", 5, 4);
	const struct layout *layout = sim_scene_layout(scene);

	(void)state;
	scene_pose_markers(scene, 3.21, &truth);
	for (uint32_t m = 0; m < layout->marker_count; m++) {
		struct vec3 p =
			pose_apply(&truth.actors[0].rt_stage_head, layout->markers[m].neutral_m);
		double moved_m = vec3_distance(p, truth.markers[m].p_stage_m);

		if (layout->markers[m].rigid)
			assert_true(moved_m < 1e-12);
		else if (strcmp(layout->markers[m].group, "lip_lower") == 0)
			assert_true(moved_m > 0.1 * MM);
	}
	sim_scene_destroy(scene);
}

static void frontal_markers_are_seen_by_three_of_four(void **state)
{
	static struct sim_truth truth;

	(void)state;
	for (uint64_t seed = 0; seed < 10; seed++) {
		struct sim_scene *scene = make("rest", seed, 4);

		sim_scene_truth(scene, 0, &truth);
		for (uint32_t m = 0; m < truth.marker_count; m++) {
			const struct face_marker *marker = &scene->actors[0].face.markers[m];

			if (marker->normal.z > cos(35 * M_PI / 180) && !marker->on_nose)
				assert_true(__builtin_popcount(truth.markers[m].visible_mask) >= 3);
		}
		sim_scene_destroy(scene);
	}
}

static void most_of_a_talking_face_is_seen_by_three_of_four(void **state)
{
	static struct sim_truth truth;
	struct sim_scene *scene = make("talking", 2, 4);
	int seen = 0, total = 0;

	(void)state;
	for (double t = 0; t < 20; t += 0.1) {
		sim_scene_truth(scene, t, &truth);
		for (uint32_t m = 0; m < truth.marker_count; m++, total++)
			seen += __builtin_popcount(truth.markers[m].visible_mask) >= 3;
	}
	assert_true(seen > 0.8 * total);
	assert_true(seen < total); /* and some of it is hidden */
	sim_scene_destroy(scene);
}

static void same_seed_is_the_same_scene_and_another_is_not(void **state)
{
	static struct sim_truth a, b, c;
	struct sim_scene *one = make("talking", 4, 4), *same = make("talking", 4, 4),
			 *other = make("talking", 5, 4);

	(void)state;
	sim_scene_truth(one, 1.5, &a);
	sim_scene_truth(same, 1.5, &b);
	sim_scene_truth(other, 1.5, &c);
	assert_memory_equal(&a, &b, sizeof(a));
	assert_memory_not_equal(&a, &c, sizeof(a));
	sim_scene_destroy(one);
	sim_scene_destroy(same);
	sim_scene_destroy(other);
}

static void impossible_options_are_refused_with_the_reason(void **state)
{
	struct sim_options bad[] = {{.scene = "singing"}, {.camera_count = 3}, {.camera_count = 25},
				    {.rate_hz = -1},      {.rate_hz = NAN},    {.rate_hz = 1e9}};
	const char *words[] = {"talking, turning", "4 to 24", "4 to 24", "1000", "1000", "1000"};

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		struct sim_scene *scene = NULL;
		struct diag diag = {0};

		assert_int_equal(sim_scene_create(&scene, &bad[i], &diag), -EINVAL);
		assert_null(scene);
		assert_non_null(strstr(diag.text, words[i]));
		diag_finish(&diag);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(seventy_face_markers_are_fifteen_millimetres_apart),
		cmocka_unit_test(marker_names_are_unique_and_flat_discs_lie_on_a_head),
		cmocka_unit_test(head_band_fits_in_one_way_only),
		cmocka_unit_test(talking_face_moves_as_fast_as_speech),
		cmocka_unit_test(resting_face_does_not_move),
		cmocka_unit_test(turning_head_turns_sixty_degrees),
		cmocka_unit_test(head_band_does_not_move_with_the_skin),
		cmocka_unit_test(frontal_markers_are_seen_by_three_of_four),
		cmocka_unit_test(most_of_a_talking_face_is_seen_by_three_of_four),
		cmocka_unit_test(same_seed_is_the_same_scene_and_another_is_not),
		cmocka_unit_test(impossible_options_are_refused_with_the_reason),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
