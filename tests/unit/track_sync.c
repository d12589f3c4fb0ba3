/*
 * Sync decides which fronts make a shot. Each test plays queues of frames through it and looks at
 * the shots that come out.
 */
#include "track/sync/sync.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"

#define MS INT64_C(1000000)
#define PERIOD_NS INT64_C(8333333)
#define QUEUE_MAX 64

/* A camera's frames still to come, and whether its recording ends behind them. */
struct queue {
	struct front frames[QUEUE_MAX];
	int count, next;
	bool endless;
};

struct player {
	struct sync sync;
	struct queue cameras[4];
	struct queue edges;
	uint32_t camera_count;
	bool with_edges;
	bool expired;
	struct sync_decision last;
	int stale_count[4];
};

static void push(struct queue *queue, uint64_t shot, int64_t mid_exposure_ns)
{
	queue->frames[queue->count++] = (struct front){FRONT_READY, shot, mid_exposure_ns};
}

static struct front front_of(const struct queue *queue)
{
	if (queue->next < queue->count)
		return queue->frames[queue->next];
	return (struct front){.state = queue->endless ? FRONT_WAITING : FRONT_ENDED};
}

/* Asks until a shot comes or nothing more does, consuming as told. */
static enum sync_result play(struct player *p)
{
	for (;;) {
		struct front fronts[4], edge = front_of(&p->edges);

		for (uint32_t c = 0; c < p->camera_count; c++)
			fronts[c] = front_of(&p->cameras[c]);
		enum sync_result result =
			sync_next(&p->sync, fronts, p->camera_count, p->with_edges ? &edge : NULL,
				  p->expired, &p->last);
		for (uint32_t c = 0; c < p->camera_count; c++) {
			p->stale_count[c] += p->last.stale_mask >> c & 1;
			p->cameras[c].next += (p->last.stale_mask | p->last.member_mask) >> c & 1;
		}
		p->edges.next += p->last.edge_used;
		if (result != SYNC_STALE)
			return result;
	}
}

static void assert_shot(struct player *p, uint64_t shot, uint32_t members)
{
	assert_int_equal(play(p), SYNC_SHOT);
	assert_int_equal(p->last.shot, shot);
	assert_int_equal(p->last.member_mask, members);
	assert_int_equal(p->last.missing_mask, ((1u << p->camera_count) - 1) & ~members);
}

static struct player player_of(uint32_t camera_count, int64_t period_ns)
{
	return (struct player){.camera_count = camera_count, .sync = {.period_ns = period_ns}};
}

static void frames_with_the_same_number_are_one_shot(void **state)
{
	struct player p = player_of(2, 0);

	(void)state;
	push(&p.cameras[0], 7, 100 * MS);
	push(&p.cameras[1], 7, 900 * MS);
	push(&p.cameras[1], 8, 901 * MS);
	assert_shot(&p, 7, 3);
	assert_int_equal(p.last.off_time_mask, 2); /* by number alone */
	assert_int_equal(p.last.mid_exposure_ns, 100 * MS);
	assert_shot(&p, 8, 2);
	assert_int_equal(p.last.off_time_mask, 0);
	assert_int_equal(play(&p), SYNC_END);
}

static void a_clock_that_jumps_has_no_say_in_the_time_of_a_numbered_shot(void **state)
{
	const int64_t years = INT64_C(1000000000000000000);

	(void)state;
	for (int wild = 0; wild < 3; wild++)
		for (int64_t jump = -years; jump <= years; jump += years / 2) {
			struct player p = player_of(3, PERIOD_NS);

			for (uint64_t shot = 0; shot < 6; shot++)
				for (int c = 0; c < 3; c++)
					push(&p.cameras[c], shot,
					     2 * years + (int64_t)shot * PERIOD_NS + c * 1000 +
						     (c == wild && shot >= 3 ? jump : 0));
			for (uint64_t shot = 0; shot < 6; shot++) {
				bool off = shot >= 3 && jump != 0;

				assert_shot(&p, shot, 7);
				assert_int_equal(p.last.off_time_mask, off ? 1 << wild : 0);
				assert_in_range(p.last.mid_exposure_ns,
						2 * years + (int64_t)shot * PERIOD_NS,
						2 * years + (int64_t)shot * PERIOD_NS + 2000);
			}
		}
}

static void numbered_frames_keep_their_numbers_over_a_drop(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	push(&p.cameras[0], 3, 0);
	push(&p.cameras[0], 9, 6 * PERIOD_NS);
	push(&p.cameras[1], 5, 2 * PERIOD_NS);
	push(&p.cameras[1], 9, 6 * PERIOD_NS);
	assert_shot(&p, 3, 1);
	assert_shot(&p, 5, 2);
	assert_shot(&p, 9, 3);
}

static void repeated_and_late_numbers_are_stale(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	push(&p.cameras[0], 1, PERIOD_NS);
	push(&p.cameras[1], 1, PERIOD_NS);
	push(&p.cameras[1], 1, PERIOD_NS);
	push(&p.cameras[1], 0, 0);
	push(&p.cameras[0], 2, 2 * PERIOD_NS);
	push(&p.cameras[1], 2, 2 * PERIOD_NS);
	assert_shot(&p, 1, 3);
	assert_shot(&p, 2, 3);
	assert_int_equal(p.stale_count[0], 0);
	assert_int_equal(p.stale_count[1], 2);
}

static void times_within_half_a_period_are_one_shot(void **state)
{
	struct player p = player_of(3, PERIOD_NS);

	(void)state;
	for (int k = 0; k < 3; k++) {
		push(&p.cameras[0], SHOT_UNKNOWN, k * PERIOD_NS);
		push(&p.cameras[1], SHOT_UNKNOWN, k * PERIOD_NS + PERIOD_NS * 4 / 10);
		push(&p.cameras[2], SHOT_UNKNOWN, k * PERIOD_NS + PERIOD_NS * 2 / 10);
	}
	for (uint64_t k = 0; k < 3; k++)
		assert_shot(&p, k, 7);
	assert_int_equal(play(&p), SYNC_END);
}

static void a_gap_of_n_periods_moves_the_shot_by_n(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	for (int c = 0; c < 2; c++) {
		push(&p.cameras[c], SHOT_UNKNOWN, 0);
		push(&p.cameras[c], SHOT_UNKNOWN, 5 * PERIOD_NS);
		push(&p.cameras[c], SHOT_UNKNOWN, 6 * PERIOD_NS);
	}
	assert_shot(&p, 0, 3);
	assert_shot(&p, 5, 3);
	assert_shot(&p, 6, 3);
}

static void the_period_is_learned_when_it_is_not_known(void **state)
{
	struct player p = player_of(2, 0);
	int64_t period_ns = 2 * PERIOD_NS;

	(void)state;
	for (int k = 0; k < 20; k++) {
		if (k == 12)
			continue; /* lost by both */
		push(&p.cameras[0], SHOT_UNKNOWN, k * period_ns);
		push(&p.cameras[1], SHOT_UNKNOWN, k * period_ns + MS);
	}
	for (uint64_t k = 0; k < 20; k++)
		if (k != 12)
			assert_shot(&p, k, 3);
	assert_true(p.sync.period_ns > period_ns * 99 / 100 &&
		    p.sync.period_ns < period_ns * 101 / 100);
}

static void a_learned_period_shrinks_when_the_first_gap_was_a_drop(void **state)
{
	struct player p = player_of(1, 0);

	(void)state;
	push(&p.cameras[0], SHOT_UNKNOWN, 0);
	for (int k = 3; k < 8; k++)
		push(&p.cameras[0], SHOT_UNKNOWN, k * PERIOD_NS);
	for (uint64_t k = 0; k < 6; k++)
		assert_shot(&p, k, 1);
	assert_int_equal(p.stale_count[0], 0);
}

static void a_dropped_frame_leaves_the_camera_missing_once(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	for (int k = 0; k < 4; k++) {
		push(&p.cameras[0], SHOT_UNKNOWN, k * PERIOD_NS);
		if (k != 2)
			push(&p.cameras[1], SHOT_UNKNOWN, k * PERIOD_NS + MS);
	}
	assert_shot(&p, 0, 3);
	assert_shot(&p, 1, 3);
	assert_shot(&p, 2, 1);
	assert_shot(&p, 3, 3);
}

static void a_repeated_time_is_stale(void **state)
{
	struct player p = player_of(1, PERIOD_NS);

	(void)state;
	push(&p.cameras[0], SHOT_UNKNOWN, 0);
	push(&p.cameras[0], SHOT_UNKNOWN, 0);
	push(&p.cameras[0], SHOT_UNKNOWN, PERIOD_NS);
	assert_shot(&p, 0, 1);
	assert_shot(&p, 1, 1);
	assert_int_equal(p.stale_count[0], 1);
}

static void a_late_camera_is_waited_for_until_the_deadline(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	p.cameras[0].endless = p.cameras[1].endless = true;
	push(&p.cameras[0], SHOT_UNKNOWN, 0);
	assert_int_equal(play(&p), SYNC_WAIT);
	p.expired = true;
	assert_shot(&p, 0, 1);
	p.expired = false;
	push(&p.cameras[1], SHOT_UNKNOWN, 0); /* too late now */
	push(&p.cameras[0], SHOT_UNKNOWN, PERIOD_NS);
	push(&p.cameras[1], SHOT_UNKNOWN, PERIOD_NS);
	assert_shot(&p, 1, 3);
	assert_int_equal(p.stale_count[1], 1);
}

static void an_expired_wait_without_any_frame_makes_no_shot(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	p.cameras[0].endless = true;
	p.expired = true;
	assert_int_equal(play(&p), SYNC_WAIT);
}

static void an_ended_camera_is_not_waited_for(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	p.cameras[0].endless = true;
	push(&p.cameras[0], SHOT_UNKNOWN, 0);
	assert_shot(&p, 0, 1);
	assert_int_equal(play(&p), SYNC_WAIT);
	p.cameras[0].endless = false;
	assert_int_equal(play(&p), SYNC_END);
}

static void an_edge_numbers_the_frames_nearest_to_it(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	p.with_edges = true;
	for (int k = 0; k < 3; k++)
		push(&p.edges, 40 + (uint64_t)k, k * PERIOD_NS);
	push(&p.cameras[0], SHOT_UNKNOWN, -3 * MS);
	push(&p.cameras[0], SHOT_UNKNOWN, 2 * PERIOD_NS + 4 * MS);
	push(&p.cameras[1], SHOT_UNKNOWN, MS);
	push(&p.cameras[1], SHOT_UNKNOWN, PERIOD_NS + MS);
	assert_shot(&p, 40, 3);
	assert_int_equal(p.last.mid_exposure_ns, -MS);
	assert_shot(&p, 41, 2);
	assert_shot(&p, 42, 1);
}

static void an_edge_that_every_camera_missed_is_a_shot_of_nobody(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	p.with_edges = true;
	p.cameras[0].endless = p.cameras[1].endless = true;
	push(&p.edges, 5, PERIOD_NS);
	assert_int_equal(play(&p), SYNC_WAIT);
	p.expired = true;
	assert_shot(&p, 5, 0);
	assert_int_equal(p.last.mid_exposure_ns, PERIOD_NS);
}

static void a_frame_before_the_edge_is_stale(void **state)
{
	struct player p = player_of(1, PERIOD_NS);

	(void)state;
	p.with_edges = true;
	push(&p.cameras[0], SHOT_UNKNOWN, -PERIOD_NS);
	push(&p.cameras[0], SHOT_UNKNOWN, 0);
	push(&p.edges, 0, 0);
	assert_shot(&p, 0, 1);
	assert_int_equal(p.stale_count[0], 1);
}

static void uneven_edges_keep_each_frame_with_its_own(void **state)
{
	struct player p = player_of(2, PERIOD_NS);
	struct rng rng;

	(void)state;
	p.with_edges = true;
	rng_init(&rng, 1, 0);
	for (int k = 0; k < 60; k++) {
		int64_t edge_ns = k * PERIOD_NS + (int64_t)(rng_uniform(&rng) * 3 * MS);

		push(&p.edges, (uint64_t)k, edge_ns);
		push(&p.cameras[0], SHOT_UNKNOWN, edge_ns + (int64_t)(rng_uniform(&rng) * MS));
		push(&p.cameras[1], SHOT_UNKNOWN, edge_ns - (int64_t)(rng_uniform(&rng) * MS));
	}
	for (uint64_t k = 0; k < 60; k++)
		assert_shot(&p, k, 3);
	assert_int_equal(p.stale_count[0] + p.stale_count[1], 0);
}

static void a_late_edge_is_waited_for_then_passed_over(void **state)
{
	struct player p = player_of(1, PERIOD_NS);

	(void)state;
	p.with_edges = p.edges.endless = p.cameras[0].endless = true;
	push(&p.edges, 10, 0);
	push(&p.cameras[0], SHOT_UNKNOWN, 0);
	assert_shot(&p, 10, 1);
	push(&p.cameras[0], SHOT_UNKNOWN, PERIOD_NS);
	assert_int_equal(play(&p), SYNC_WAIT);
	p.expired = true;
	assert_shot(&p, 11, 1);
	p.expired = false;
	push(&p.edges, 11, PERIOD_NS);
	push(&p.edges, 12, 2 * PERIOD_NS);
	push(&p.cameras[0], SHOT_UNKNOWN, 2 * PERIOD_NS);
	assert_shot(&p, 12, 1);
	assert_int_equal(p.edges.next, 3);
}

static void uneven_jitter_splits_no_shot(void **state)
{
	struct player p = player_of(4, PERIOD_NS);
	struct rng rng;

	(void)state;
	rng_init(&rng, 2, 0);
	for (int k = 0; k < 60; k++)
		for (int c = 0; c < 4; c++)
			push(&p.cameras[c], SHOT_UNKNOWN,
			     k * PERIOD_NS + (int64_t)(rng_uniform(&rng) * 2 * MS));
	for (uint64_t k = 0; k < 60; k++)
		assert_shot(&p, k, 15);
}

static void an_epoch_far_away_neither_overflows_nor_loses(void **state)
{
	struct player p = player_of(2, PERIOD_NS);
	int64_t far_ns = INT64_MAX - 2 * PERIOD_NS;

	(void)state;
	push(&p.cameras[0], SHOT_UNKNOWN, INT64_MIN);
	push(&p.cameras[0], SHOT_UNKNOWN, far_ns);
	push(&p.cameras[0], SHOT_UNKNOWN, far_ns + PERIOD_NS);
	push(&p.cameras[1], SHOT_UNKNOWN, far_ns + MS);
	push(&p.cameras[1], SHOT_UNKNOWN, far_ns + PERIOD_NS);
	assert_shot(&p, 0, 1);
	assert_int_equal(play(&p), SYNC_SHOT);
	assert_int_equal(p.last.member_mask, 3);
	assert_int_equal(p.last.mid_exposure_ns, far_ns + MS / 2);
	assert_int_equal(play(&p), SYNC_SHOT);
	assert_int_equal(p.last.member_mask, 3);
}

static void numbered_and_unnumbered_cameras_meet_by_time(void **state)
{
	struct player p = player_of(2, PERIOD_NS);

	(void)state;
	for (int k = 0; k < 5; k++) {
		if (k != 2)
			push(&p.cameras[0], 100 + (uint64_t)k, k * PERIOD_NS);
		push(&p.cameras[1], SHOT_UNKNOWN, k * PERIOD_NS + MS);
	}
	assert_shot(&p, 100, 3);
	assert_shot(&p, 101, 3);
	assert_shot(&p, 102, 2);
	assert_shot(&p, 103, 3);
	assert_shot(&p, 104, 3);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(frames_with_the_same_number_are_one_shot),
		cmocka_unit_test(a_clock_that_jumps_has_no_say_in_the_time_of_a_numbered_shot),
		cmocka_unit_test(numbered_frames_keep_their_numbers_over_a_drop),
		cmocka_unit_test(repeated_and_late_numbers_are_stale),
		cmocka_unit_test(times_within_half_a_period_are_one_shot),
		cmocka_unit_test(a_gap_of_n_periods_moves_the_shot_by_n),
		cmocka_unit_test(the_period_is_learned_when_it_is_not_known),
		cmocka_unit_test(a_learned_period_shrinks_when_the_first_gap_was_a_drop),
		cmocka_unit_test(a_dropped_frame_leaves_the_camera_missing_once),
		cmocka_unit_test(a_repeated_time_is_stale),
		cmocka_unit_test(a_late_camera_is_waited_for_until_the_deadline),
		cmocka_unit_test(an_expired_wait_without_any_frame_makes_no_shot),
		cmocka_unit_test(an_ended_camera_is_not_waited_for),
		cmocka_unit_test(an_edge_numbers_the_frames_nearest_to_it),
		cmocka_unit_test(an_edge_that_every_camera_missed_is_a_shot_of_nobody),
		cmocka_unit_test(a_frame_before_the_edge_is_stale),
		cmocka_unit_test(uneven_edges_keep_each_frame_with_its_own),
		cmocka_unit_test(a_late_edge_is_waited_for_then_passed_over),
		cmocka_unit_test(uneven_jitter_splits_no_shot),
		cmocka_unit_test(an_epoch_far_away_neither_overflows_nor_loses),
		cmocka_unit_test(numbered_and_unnumbered_cameras_meet_by_time),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
