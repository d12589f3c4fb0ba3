/*
 * Events, bodies, glints and who hides whom.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/unit/sim_written.h"

#define MM 1e-3

static const char STILL[] = "- {name: a, performance: still}";

static struct sim_truth truth;

static int views(const struct sim_scene *scene, double time_s, const char *marker)
{
	sim_scene_truth(scene, time_s, &truth);
	return __builtin_popcount(truth.markers[label_named(scene, marker)].visible_mask);
}

static void fallen_marker_is_gone_for_good_or_for_the_time(void **state)
{
	struct sim_scene *scene =
		scene_written(8, 1, STILL,
			      "- {kind: fall_off, what: nose_4, at_s: 2}\n"
			      "- {kind: fall_off, what: chin_1, at_s: 2, for_s: 3}");

	(void)state;
	assert_true(views(scene, 1.9, "nose_4") >= 3);
	assert_true(truth.markers[label_named(scene, "nose_4")].worn);
	assert_int_equal(views(scene, 2.1, "nose_4"), 0);
	assert_int_equal(views(scene, 50, "nose_4"), 0);
	assert_false(truth.markers[label_named(scene, "nose_4")].worn);
	assert_int_equal(views(scene, 3, "chin_1"), 0);
	assert_true(views(scene, 5.1, "chin_1") >= 3);
	sim_scene_destroy(scene);
}

static void slip_moves_the_band_and_nothing_else(void **state)
{
	struct sim_scene *scene =
		scene_written(4, 2, STILL, "- {kind: jig_slip, at_s: 2, amount: 5}");
	double band_m = 0;
	int band_count = 0;

	(void)state;
	scene_pose_markers(scene, 10, &truth);
	for (uint32_t m = 0; m < truth.marker_count; m++) {
		double moved_m = vec3_distance(on_head(scene, &truth, m),
					       scene->layout.markers[m].neutral_m);

		if (!scene->layout.markers[m].rigid) {
			assert_true(moved_m < 1e-9);
			continue;
		}
		band_m += moved_m;
		band_count++;
	}
	assert_true(fabs(band_m / band_count - 5 * MM) < 2.5 * MM);
	sim_scene_destroy(scene);
}

static void hand_hides_nose_and_mouth_as_it_passes(void **state)
{
	struct sim_scene *scene = scene_written(8, 3, STILL, "- {kind: hand, at_s: 2, for_s: 2}");
	int before = views(scene, 1.9, "nose_4"), behind = views(scene, 3, "nose_4");

	(void)state;
	assert_true(before >= 5);
	assert_true(behind <= before / 2);
	assert_int_equal(views(scene, 4.1, "nose_4"), before);
	assert_true(views(scene, 3, "forehead_1") > 0); /* not everything */
	sim_scene_destroy(scene);
}

static void passer_takes_the_cameras_one_after_another(void **state)
{
	struct sim_scene *scene = scene_written(8, 4, STILL, "- {kind: passer, at_s: 2, for_s: 3}");
	uint32_t lost = 0, usual, label = label_named(scene, "nose_2");

	(void)state;
	views(scene, 1, "nose_2");
	usual = truth.markers[label].visible_mask;
	for (double t = 2; t < 5; t += 0.05) {
		sim_scene_truth(scene, t, &truth);
		uint32_t mask = truth.markers[label].visible_mask;

		assert_true((mask | usual) == usual);
		assert_true(mask != 0);
		lost |= usual & ~mask;
	}
	assert_true(__builtin_popcount(lost) >= 5);
	sim_scene_destroy(scene);
}

static double yaw_deg(const struct sim_scene *scene, double time_s)
{
	scene_pose_markers(scene, time_s, &truth);
	const struct pose *head = &truth.actors[0].rt_stage_head;

	return atan2(-head->r[0][2], head->r[1][2]) * 180 / M_PI;
}

static void turn_goes_as_far_as_it_says_and_comes_back(void **state)
{
	struct sim_scene *scene =
		scene_written(8, 5, STILL, "- {kind: turn, at_s: 2, for_s: 4, amount: 70}");
	double before = yaw_deg(scene, 1), there = yaw_deg(scene, 4);

	(void)state;
	assert_true(fabs(fabs(there - before) - 70) < 3);
	assert_true(fabs(yaw_deg(scene, 6.1) - before) < 1e-9);
	sim_scene_destroy(scene);
}

static void micro_expression_moves_its_group_by_its_amount(void **state)
{
	struct sim_scene *scene = scene_written(
		4, 6, STILL, "- {kind: micro, what: brow, at_s: 2, for_s: 3, amount: 0.2}");

	(void)state;
	scene_pose_markers(scene, 3.5, &truth);
	for (uint32_t m = 0; m < truth.marker_count; m++) {
		const struct layout_marker *marker = &scene->layout.markers[m];
		double moved_m = vec3_distance(on_head(scene, &truth, m), marker->neutral_m);
		double wanted_m = strcmp(marker->group, "brow") == 0 ? 0.2 * MM : 0;

		assert_true(fabs(moved_m - wanted_m) < 1e-9);
	}
	sim_scene_destroy(scene);
}

static void held_expression_stands_still_in_speech(void **state)
{
	struct sim_scene *scene = scene_written(
		4, 7, "- {name: a}",
		"- {kind: expression, what: lip_press, at_s: 2, for_s: 3, amount: 1}");
	uint32_t upper = label_named(scene, "lip_u_1"), lower = label_named(scene, "lip_d_1");

	(void)state;
	for (double t = 2.6; t < 4.4; t += 0.1) {
		scene_pose_markers(scene, t, &truth);
		assert_true(fabs(vec3_distance(truth.markers[upper].p_stage_m,
					       truth.markers[lower].p_stage_m) -
				 2.4 * MM) < 0.01 * MM);
	}
	sim_scene_destroy(scene);
}

static void markers_put_on_anew_are_off_along_the_skin(void **state)
{
	struct sim_scene *scene = scene_written(
		4, 8, "- {name: a, face_markers: 182, performance: still, reapplied_m: 0.002}", "");
	double sum2 = 0, along2 = 0;
	int count = 0;

	(void)state;
	scene_pose_markers(scene, 0, &truth);
	for (uint32_t m = 0; m < 182; m++) {
		struct vec3 off =
			vec3_sub(on_head(scene, &truth, m), scene->layout.markers[m].neutral_m);
		double out_m = vec3_dot(off, scene->actors[0].face.markers[m].normal);

		sum2 += vec3_dot(off, off);
		along2 += out_m * out_m;
		count++;
	}
	assert_true(fabs(sqrt(sum2 / count / 2) - 2 * MM) < 0.35 * MM); /* per axis of two */
	assert_true(along2 < 0.1 * sum2);
	sim_scene_destroy(scene);
}

static double misfit_m(const struct sim_scene *scene, const char *segment,
		       const struct pose *rt_stage_neutral)
{
	double worst_m = 0;

	for (uint32_t m = 0; m < truth.marker_count; m++) {
		const struct layout_marker *marker = &scene->layout.markers[m];

		if (strcmp(marker->segment, segment) == 0)
			worst_m =
				fmax(worst_m,
				     vec3_distance(pose_apply(rt_stage_neutral, marker->neutral_m),
						   truth.markers[m].p_stage_m));
	}
	return worst_m;
}

static void body_segments_stay_rigid_while_they_move(void **state)
{
	struct sim_scene *scene = scene_written(8, 9, "- {name: a, body_markers: 22}", "");
	struct vec3 least = {9, 9, 9}, most = {-9, -9, -9};
	uint32_t wrist = label_named(scene, "forearm_l_3");
	int body = 0;

	(void)state;
	for (uint32_t m = 0; m < scene->layout.marker_count; m++) {
		double diameter_m = scene->layout.markers[m].diameter_m;

		if (*scene->layout.markers[m].segment) {
			body++;
			assert_true(diameter_m >= 9 * MM && diameter_m <= 14 * MM);
		}
	}
	assert_int_equal(body, 22);
	for (double t = 0; t < 20; t += 0.1) {
		scene_pose_markers(scene, t, &truth);
		for (int s = 0; s < SEGMENT_COUNT; s++)
			assert_true(misfit_m(scene, BODY_SEGMENT_NAMES[s],
					     &truth.actors[0].rt_stage_segment[s]) < 1e-9);
		struct vec3 p = truth.markers[wrist].p_stage_m;

		least = (struct vec3){fmin(least.x, p.x), fmin(least.y, p.y), fmin(least.z, p.z)};
		most = (struct vec3){fmax(most.x, p.x), fmax(most.y, p.y), fmax(most.z, p.z)};
	}
	assert_true(vec3_distance(least, most) > 0.05);
	sim_scene_destroy(scene);
}

static void chest_and_back_are_seen_from_their_sides_only(void **state)
{
	struct sim_scene *scene =
		scene_written(24, 10, "- {name: a, body_markers: 22, performance: still}", "");
	uint32_t chest = label_named(scene, "chest_1"), back = label_named(scene, "back_1");

	(void)state;
	sim_scene_truth(scene, 0, &truth);
	uint32_t front = truth.markers[chest].visible_mask, rear = truth.markers[back].visible_mask;

	assert_true(__builtin_popcount(front) >= 3 && __builtin_popcount(rear) >= 3);
	assert_int_equal(front & rear, 0);
	sim_scene_destroy(scene);
}

static const char SIX[] =
	"- {name: a, body_markers: 22, seat_m: [-1, -0.8, 1.6], facing_deg: -45}\n"
	"- {name: b, face_markers: 35, seat_m: [1, -0.8, 1.6], facing_deg: 45}\n"
	"- {name: c, body_markers: 22, seat_m: [1, 0.8, 1.6], facing_deg: 135}\n"
	"- {name: d, face_markers: 35, seat_m: [-1, 0.8, 1.6], facing_deg: -135}\n"
	"- {name: e, face_markers: 182, ghosts_teeth: true, seat_m: [0, 1.2, 1.6]}\n"
	"- {name: f, ghosts_eyes: true, seat_m: [0, -1.2, 1.6], facing_deg: 180}";

static void six_actors_have_six_faces_in_one_layout(void **state)
{
	struct sim_scene *scene = scene_written(24, 11, SIX, "");
	const struct layout *layout = sim_scene_layout(scene);
	uint32_t next = 0;

	(void)state;
	assert_int_equal(layout->actor_count, 6);
	for (uint32_t a = 0; a < 6; a++) {
		assert_int_equal(layout->actors[a].first, next);
		next += layout->actors[a].count;
		for (uint32_t b = 0; b < a; b++)
			assert_true(scene->actors[a].face.skull.axes_m.x !=
				    scene->actors[b].face.skull.axes_m.x);
	}
	assert_int_equal(next, layout->marker_count);
	sim_scene_destroy(scene);
}

/* The mask asks only what can matter; the question for one marker asks everything. */
static void masks_say_what_each_camera_says_by_itself(void **state)
{
	struct sim_scene *scene = scene_written(24, 12, SIX,
						"- {kind: hand, actor: a, at_s: 0.5, for_s: 3}\n"
						"- {kind: passer, actor: c, at_s: 0.5, for_s: 3}");
	double pixel[2], facing;
	int seen = 0, hidden = 0;

	(void)state;
	for (double t = 0.7; t < 3.5; t += 0.9) {
		sim_scene_truth(scene, t, &truth);
		for (uint32_t m = 0; m < truth.marker_count; m++)
			for (uint32_t c = 0; c < 24; c++) {
				bool sees = scene_camera_sees(scene, &truth, c, m, pixel, &facing);

				assert_int_equal(truth.markers[m].visible_mask >> c & 1, sees);
				*(sees ? &seen : &hidden) += 1;
			}
	}
	assert_true(seen > 5000 && hidden > 5000);
	sim_scene_destroy(scene);
}

/* Rays to a glint from all cameras meet where the surface's curvature has its centre. */
static void glints_are_at_consistent_places_while_mouth_and_eyes_are_open(void **state)
{
	struct sim_scene *scene = scene_written(
		8, 13, "- {name: a, performance: still, ghosts_teeth: true, ghosts_eyes: true}",
		"- {kind: expression, what: grin, at_s: 2, for_s: 2, amount: 1}\n"
		"- {kind: expression, what: blink, at_s: 6, for_s: 2, amount: 1}");
	int eyes = 0, teeth = 0;

	(void)state;
	sim_scene_truth(scene, 3, &truth);
	assert_int_equal(truth.ghost_count, 6);
	for (uint32_t g = 0; g < truth.ghost_count; g++) {
		for (uint32_t c = 0; c < 8; c++) {
			struct vec3 p, eye = scene->cameras[c].centre_stage_m;
			double pixel[2], brightness;

			if (!scene_camera_sees_ghost(scene, &truth, c, g, &p, pixel, &brightness))
				continue;
			struct vec3 ray = vec3_unit(vec3_sub(p, eye));
			struct vec3 to = vec3_sub(truth.ghosts[g].centre_stage_m, eye);

			assert_true(vec3_norm(vec3_cross(to, ray)) < 0.3 * MM);
			assert_true(brightness > 0 && brightness < 1.1);
			*(scene->actors[0].face.ghosts[g].kind == GLOSS_TOOTH ? &teeth : &eyes) +=
				1;
		}
	}
	assert_true(teeth >= 8 && eyes >= 4);
	sim_scene_truth(scene, 7, &truth); /* lips and lids closed */
	for (uint32_t g = 0; g < truth.ghost_count; g++)
		assert_int_equal(truth.ghosts[g].visible_mask, 0);
	sim_scene_destroy(scene);
}

static void names_that_there_are_not_are_refused(void **state)
{
	static const struct sim_script empty;
	static struct scene_actor actor;
	static struct happenings happenings;
	static struct sim_script script;
	static const struct sim_event bad[] = {
		{.kind = SIM_EVENT_EXPRESSION, .what = "sulk"},
		{.kind = SIM_EVENT_FALL_OFF, .what = "nose_99"},
		{.kind = SIM_EVENT_MICRO, .what = "ears"},
		{.kind = SIM_EVENT_TURN, .actor = "zoe"},
	};
	static const char *const words[] = {"expression 'sulk'", "marker 'nose_99'", "group 'ears'",
					    "actor 'zoe'"};

	(void)state;
	script = empty;
	script.actor_count = 1;
	face_init(&actor.face, &(struct face_options){.marker_count = 70}, 1);
	actor.marker_count = actor.face.marker_count;
	for (size_t i = 0; i < 4; i++) {
		struct diag diag = {0};

		script.event_count = 1;
		script.events[0] = bad[i];
		assert_int_equal(happenings_init(&happenings, &script, &actor, 1, &diag), -EINVAL);
		assert_non_null(strstr(diag.text, words[i]));
		diag_finish(&diag);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(fallen_marker_is_gone_for_good_or_for_the_time),
		cmocka_unit_test(slip_moves_the_band_and_nothing_else),
		cmocka_unit_test(hand_hides_nose_and_mouth_as_it_passes),
		cmocka_unit_test(passer_takes_the_cameras_one_after_another),
		cmocka_unit_test(turn_goes_as_far_as_it_says_and_comes_back),
		cmocka_unit_test(micro_expression_moves_its_group_by_its_amount),
		cmocka_unit_test(held_expression_stands_still_in_speech),
		cmocka_unit_test(markers_put_on_anew_are_off_along_the_skin),
		cmocka_unit_test(body_segments_stay_rigid_while_they_move),
		cmocka_unit_test(chest_and_back_are_seen_from_their_sides_only),
		cmocka_unit_test(six_actors_have_six_faces_in_one_layout),
		cmocka_unit_test(masks_say_what_each_camera_says_by_itself),
		cmocka_unit_test(glints_are_at_consistent_places_while_mouth_and_eyes_are_open),
		cmocka_unit_test(names_that_there_are_not_are_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
