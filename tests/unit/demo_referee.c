/*
 * The judge of the demonstration: what it calls right, wrong, swapped and lost.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "demo/align.h"
#include "demo/referee.h"

#define EPOCH_NS (INT64_C(1000) * NS_PER_S)

/* A stream that a flawless station would send; tests spoil it. */
struct game {
	struct sim_scene *scene;
	struct referee referee;
	struct stage_label labels[LABEL_MAX];
	struct stage_marker markers[LABEL_MAX];
	struct stage_marker_set set;
};

static int set_up(void **state)
{
	struct game *g = calloc(1, sizeof(*g));
	struct sim_options options = {
		.scene = "rest", .seed = 1, .camera_count = 8, .rate_hz = 120};

	assert_int_equal(sim_scene_create(&g->scene, &options, NULL), 0);
	referee_init(&g->referee, g->scene, EPOCH_NS);
	const struct layout *layout = sim_scene_layout(g->scene);
	struct stage_description description = {.label_count = layout->marker_count,
						.labels = g->labels};
	for (uint32_t i = 0; i < layout->marker_count; i++)
		g->labels[i].name = layout->markers[layout->marker_count - 1 - i].name;
	assert_int_equal(referee_describe(&g->referee, &description), 0);
	*state = g;
	return 0;
}

static int tear_down(void **state)
{
	struct game *g = *state;

	sim_scene_destroy(g->scene);
	free(g);
	return 0;
}

/* Labels come in the reverse order of the scene's layout. */
static void make_set(struct game *g, uint64_t shot)
{
	static struct sim_truth truth;
	int64_t mid_ns = sim_scene_mid_exposure_ns(g->scene, shot);

	sim_scene_truth(g->scene, (double)mid_ns / 1e9, &truth);
	g->set = (struct stage_marker_set){.shot = 7000 + shot,
					   .mid_exposure_ns = EPOCH_NS + mid_ns,
					   .arrival_ns = EPOCH_NS + mid_ns + NS_PER_MS,
					   .marker_count = truth.marker_count,
					   .markers = g->markers};
	for (uint32_t i = 0; i < truth.marker_count; i++) {
		struct vec3 p_m = truth.markers[truth.marker_count - 1 - i].p_stage_m;

		g->markers[i] = (struct stage_marker){.label = (int32_t)i,
						      .status = STAGE_MEASURED,
						      .p_m = {p_m.x, p_m.y, p_m.z}};
	}
}

static void judge(struct game *g)
{
	referee_judge(&g->referee, &g->set, g->set.arrival_ns + 2 * NS_PER_MS);
}

static struct results results_at(const struct game *g, uint64_t shot)
{
	return referee_results(&g->referee, EPOCH_NS + sim_scene_mid_exposure_ns(g->scene, shot));
}

static void flawless_stream_passes(void **state)
{
	struct game *g = *state;

	for (uint64_t shot = 50; shot < 100; shot++) {
		make_set(g, shot);
		judge(g);
	}
	struct results r = results_at(g, 99);
	assert_int_equal(r.shots_expected, 50);
	assert_int_equal(r.shots_lost, 0);
	assert_true(r.accurate && r.named && r.complete);
	assert_true(g->referee.seen_count > 50 * 30);
	assert_int_equal(g->referee.right_count, g->referee.seen_count);
	assert_true(r.error_median_mm < 0.001);
	assert_true(fabs(r.latency_p50_ms - 2) < 0.05);
	assert_true(fabs(r.rate_hz - 120) < 0.01);
}

static void displaced_markers_show_in_the_error(void **state)
{
	struct game *g = *state;

	make_set(g, 50);
	for (uint32_t i = 0; i < g->set.marker_count; i++)
		g->markers[i].p_m[1] += 0.0002;
	judge(g);
	struct results r = results_at(g, 50);
	assert_true(fabs(r.error_median_mm - 0.2) < 0.001);
	assert_true(fabs(r.error_rms_mm - 0.2) < 0.001);
	assert_true(r.named && !r.accurate);
}

static void swapped_labels_are_wrong_and_swapped(void **state)
{
	struct game *g = *state;

	make_set(g, 50);
	g->markers[10].label = 11;
	g->markers[11].label = 10;
	judge(g);
	assert_int_equal(g->referee.wrong_count, 2);
	assert_int_equal(g->referee.swapped_count, 2);
}

static void marker_in_empty_space_is_wrong_and_not_swapped(void **state)
{
	struct game *g = *state;

	make_set(g, 50);
	g->markers[10].p_m[2] += 1;
	judge(g);
	assert_int_equal(g->referee.wrong_count, 1);
	assert_int_equal(g->referee.swapped_count, 0);
}

static void predicted_missing_and_left_out_markers_are_unlabelled(void **state)
{
	struct game *g = *state;

	make_set(g, 50);
	uint32_t count = g->set.marker_count;
	for (uint32_t i = 0; i < count; i++)
		g->markers[i].status = i % 2 ? STAGE_PREDICTED : STAGE_MISSING;
	g->set.marker_count = count / 2;
	judge(g);
	struct results r = results_at(g, 50);
	assert_true(g->referee.seen_count > count / 2);
	assert_int_equal(g->referee.unlabelled_count, g->referee.seen_count);
	assert_int_equal(g->referee.wrong_count, 0);
	assert_true(r.right_percent == 0 && !r.named && !r.accurate);
}

static void shots_that_never_came_are_lost(void **state)
{
	struct game *g = *state;

	for (uint64_t shot = 50; shot < 150; shot++) {
		make_set(g, shot);
		if (shot != 70 && shot != 71)
			judge(g);
	}
	struct results r = results_at(g, 149);
	assert_int_equal(r.shots_expected, 100);
	assert_int_equal(r.shots_lost, 2);
	assert_false(r.complete);
}

static void stream_that_stands_still_loses_what_the_scene_goes_on_to_show(void **state)
{
	struct game *g = *state;

	make_set(g, 50);
	judge(g);
	assert_int_equal(results_at(g, 149).shots_lost, 99);
}

static void shot_sent_twice_counts_once(void **state)
{
	struct game *g = *state;

	make_set(g, 50);
	judge(g);
	judge(g);
	assert_int_equal(g->referee.sets_repeated, 1);
	assert_int_equal(results_at(g, 50).shots_received, 1);
}

static void wrong_time_is_reported_apart_from_the_place(void **state)
{
	struct game *g = *state;

	make_set(g, 50);
	g->set.mid_exposure_ns += 300 * NS_PER_US;
	g->set.uncertainty_ns = 200 * NS_PER_US;
	judge(g);
	assert_int_equal(g->referee.beyond_bound_count, 1);
	struct results r = results_at(g, 50);
	assert_true(fabs(r.timestamp_p50_us - 300) < 1);
	assert_true(r.error_median_mm < 0.001);
}

static void stream_without_a_set_does_not_pass(void **state)
{
	struct game *g = *state;
	struct results r = results_at(g, 50);

	assert_false(r.accurate || r.named || r.complete);
}

/* As of a rig that was made anew. */
static void use_another_frame(struct game *g)
{
	struct pose pose = pose_from_rotation_vector((struct vec3){0.3, -1.1, 0.7});

	pose.t = (struct vec3){0.4, 1.2, -0.8};
	for (uint32_t i = 0; i < g->set.marker_count; i++) {
		double *p = g->markers[i].p_m;
		struct vec3 moved = pose_apply(&pose, (struct vec3){p[0], p[1], p[2]});

		p[0] = moved.x;
		p[1] = moved.y;
		p[2] = moved.z;
	}
}

static void a_frame_of_its_own_is_found_in_the_first_second(void **state)
{
	struct align *align = calloc(1, sizeof(*align));
	struct game *g = *state;
	uint64_t shot = 50;

	for (; shot < 250 && !align->done; shot++) {
		make_set(g, shot);
		if (shot % 10 == 0) /* a wrong name now and then does not move the frame */
			g->markers[10].p_m[0] += 0.03;
		use_another_frame(g);
		align_take(align, &g->referee, &g->set);
	}
	assert_in_range(shot, 150, 180);
	for (uint64_t end = shot + 20; shot < end; shot++) {
		make_set(g, shot);
		use_another_frame(g);
		judge(g);
	}
	assert_int_equal(g->referee.wrong_count, 0);
	assert_true(results_at(g, shot - 1).error_rms_mm < 0.001);
	free(align);
}

static void labels_of_another_scene_are_refused(void **state)
{
	struct game *g = *state;
	struct stage_description description = {
		.label_count = sim_scene_layout(g->scene)->marker_count, .labels = g->labels};

	g->labels[3].name = "tail";
	assert_int_equal(referee_describe(&g->referee, &description), -EINVAL);
}

int main(void)
{
#define GAME_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
	const struct CMUnitTest tests[] = {
		GAME_TEST(flawless_stream_passes),
		GAME_TEST(displaced_markers_show_in_the_error),
		GAME_TEST(swapped_labels_are_wrong_and_swapped),
		GAME_TEST(marker_in_empty_space_is_wrong_and_not_swapped),
		GAME_TEST(predicted_missing_and_left_out_markers_are_unlabelled),
		GAME_TEST(shots_that_never_came_are_lost),
		GAME_TEST(stream_that_stands_still_loses_what_the_scene_goes_on_to_show),
		GAME_TEST(shot_sent_twice_counts_once),
		GAME_TEST(wrong_time_is_reported_apart_from_the_place),
		GAME_TEST(stream_without_a_set_does_not_pass),
		GAME_TEST(a_frame_of_its_own_is_found_in_the_first_second),
		GAME_TEST(labels_of_another_scene_are_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("demo_referee", tests, NULL, NULL);
}
