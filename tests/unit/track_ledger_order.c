/*
 * The ledger while edges and frames come in whatever order: each frame may be handed over before
 * its edge is reported. Truth is known for every frame; no fault may put one into another shot, and
 * what is named is named in its very shot.
 */
#include "track/sync/ledger.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"

#define PERIOD_NS INT64_C(8333333)
#define DEADLINE_NS (3 * PERIOD_NS)
#define FIRST_SHOT 1000
#define SHOTS 600
#define FAULT_SHOT (FIRST_SHOT + 300)
#define EVENTS_MAX (2 * SHOTS + 8)

enum fault {
	NO_FAULT,
	PULSE_NOT_FIRED, /* the trigger missed the period, and says so with its next edge */
	EDGE_LOST,       /* fired, and never reported */
	EDGE_LATE,       /* reported periods after its frames came */
	FRAME_DROPPED,   /* counted, not delivered */
	FRAME_MISSED,    /* neither exposed nor counted */
	FRAME_REPEATED,
	FRAME_LATE, /* and those behind it after it */
	FAULT_COUNT
};

/* What the solver gets, in the order in which it comes. */
struct happening {
	int64_t at_ns, mid_exposure_ns;
	uint64_t shot, seq;
	uint32_t missed;
	bool is_edge;
};

struct play {
	enum fault fault;
	uint64_t length;          /* shots that it strikes */
	int64_t report_ns;        /* from the exposure to the edge's report: at least, */
	int64_t report_jitter_ns; /* and so much more */
	int64_t arrival_ns;       /* the same of frames */
	int64_t stamp_jitter_ns;
	uint64_t seed;
};

static struct ledger ledger;
static struct happening happenings[EVENTS_MAX];
static int happening_count;

static int64_t time_of(uint64_t shot)
{
	return 50 * PERIOD_NS + (int64_t)(shot - FIRST_SHOT) * PERIOD_NS;
}

static bool strikes(const struct play *play, enum fault fault, uint64_t shot)
{
	return play->fault == fault && shot >= FAULT_SHOT && shot < FAULT_SHOT + play->length;
}

static void add(const struct happening *happening)
{
	assert_true(happening_count < EVENTS_MAX);
	happenings[happening_count++] = *happening;
}

static int64_t random_ns(struct rng *rng, int64_t most_ns)
{
	return (int64_t)(rng_uniform(rng) * (double)most_ns);
}

static void report_edges(const struct play *play, struct rng *rng)
{
	int64_t last_ns = 0;
	uint32_t missed = 0;

	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + SHOTS; shot++) {
		int64_t at_ns =
			time_of(shot) + play->report_ns + random_ns(rng, play->report_jitter_ns);

		if (strikes(play, PULSE_NOT_FIRED, shot)) {
			missed++;
			continue;
		}
		if (strikes(play, EDGE_LOST, shot))
			continue;
		if (strikes(play, EDGE_LATE, shot))
			at_ns += 2 * PERIOD_NS;
		last_ns = at_ns > last_ns ? at_ns : last_ns + 1;
		add(&(struct happening){.at_ns = last_ns,
					.mid_exposure_ns = time_of(shot),
					.shot = shot,
					.missed = missed,
					.is_edge = true});
		missed = 0;
	}
}

static void deliver_frames(const struct play *play, struct rng *rng)
{
	int64_t last_ns = 0;
	uint64_t seq = 7;

	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + SHOTS; shot++) {
		struct happening frame = {.shot = shot};

		frame.at_ns = time_of(shot) + play->arrival_ns + random_ns(rng, PERIOD_NS / 8) +
			      (strikes(play, FRAME_LATE, shot) ? 2 * PERIOD_NS : 0);
		frame.mid_exposure_ns = time_of(shot) + random_ns(rng, play->stamp_jitter_ns) -
					play->stamp_jitter_ns / 2;
		if (strikes(play, PULSE_NOT_FIRED, shot) || strikes(play, FRAME_MISSED, shot))
			continue;
		frame.seq = seq++;
		if (strikes(play, FRAME_DROPPED, shot))
			continue;
		if (frame.at_ns <= last_ns)
			frame.at_ns = last_ns + 1;
		last_ns = frame.at_ns;
		add(&frame);
		frame.at_ns = ++last_ns;
		if (strikes(play, FRAME_REPEATED, shot))
			add(&frame);
	}
}

static int by_time(const void *a, const void *b)
{
	int64_t a_ns = ((const struct happening *)a)->at_ns;
	int64_t b_ns = ((const struct happening *)b)->at_ns;

	return (a_ns > b_ns) - (a_ns < b_ns);
}

struct outcome {
	uint64_t frames, taken, mispaired;
};

/* As the solver does: frames in order, the front waits for its edge until the deadline. */
static void judge_front(const struct happening *frame, int64_t now_ns, int *front, int *judged,
			struct outcome *out)
{
	struct ledger_frame own = {frame->seq, frame->mid_exposure_ns, frame->at_ns};
	bool final = now_ns >= frame->at_ns + DEADLINE_NS;
	int64_t mid_exposure_ns;
	uint64_t found;
	enum ledger_verdict verdict =
		ledger_judge(&ledger, 0, &own, final, &found, &mid_exposure_ns);

	if (verdict == LEDGER_WAIT)
		return;
	*front = ++*judged;
	out->frames++;
	out->taken += verdict == LEDGER_TAKE;
	out->mispaired += verdict == LEDGER_TAKE && found != frame->shot;
}

/* Judges what can be judged of the frames that have come by `now_ns`. */
static void catch_up(int64_t now_ns, int *front, struct outcome *out)
{
	while (*front < happening_count && happenings[*front].at_ns <= now_ns) {
		int before = *front, judged = *front;

		if (happenings[*front].is_edge)
			++*front;
		else
			judge_front(&happenings[*front], now_ns, front, &judged, out);
		if (*front == before)
			return;
	}
}

static struct outcome run(const struct play *play)
{
	struct outcome out = {0};
	struct rng rng;
	int front = 0;

	happening_count = 0;
	ledger_init(&ledger, PERIOD_NS);
	rng_init(&rng, play->seed, 3);
	report_edges(play, &rng);
	deliver_frames(play, &rng);
	qsort(happenings, (size_t)happening_count, sizeof(happenings[0]), by_time);
	for (int i = 0; i < happening_count; i++) {
		const struct happening *now = &happenings[i];

		if (now->is_edge) {
			assert_true(edges_add(&ledger.edges, now->shot, now->missed,
					      now->mid_exposure_ns));
			edges_settle_next(&ledger.edges);
		}
		catch_up(now->at_ns, &front, &out);
	}
	catch_up(INT64_MAX, &front, &out);
	return out;
}

static uint64_t count(enum ledger_event event)
{
	return ledger.cameras[0].counts[event];
}

static void expect_only(const struct play *play, uint32_t mask)
{
	for (int e = 0; e < LEDGER_EVENT_COUNT; e++)
		if (!(mask >> e & 1) && count((enum ledger_event)e))
			fail_msg("fault %d, %u shots, reported after %lld ns: %s %u times",
				 play->fault, (unsigned)play->length, (long long)play->report_ns,
				 ledger_event_name((enum ledger_event)e),
				 (unsigned)count((enum ledger_event)e));
}

#define ONLY(event) (1u << (event))

/* Whose frames come a third of a period before their edges are reported. */
static struct play ahead(enum fault fault)
{
	return (struct play){.fault = fault,
			     .length = 1,
			     .report_ns = PERIOD_NS / 2,
			     .arrival_ns = PERIOD_NS / 16,
			     .seed = 1};
}

static void a_pulse_not_fired_is_no_fault_of_a_camera_ahead_of_its_edges(void **state)
{
	struct play play = ahead(PULSE_NOT_FIRED);
	struct outcome out;

	(void)state;
	for (play.length = 1; play.length <= 4; play.length++) {
		out = run(&play);
		assert_int_equal(out.mispaired, 0);
		assert_int_equal(out.taken, SHOTS - play.length);
		expect_only(&play, 0);
	}
}

static void a_missed_trigger_is_named_in_its_very_shot(void **state)
{
	struct play play = ahead(FRAME_MISSED);

	(void)state;
	for (play.length = 1; play.length <= 4; play.length++)
		for (play.report_ns = 0; play.report_ns <= PERIOD_NS;
		     play.report_ns += PERIOD_NS / 2) {
			struct outcome out = run(&play);

			assert_int_equal(out.mispaired, 0);
			expect_only(&play, ONLY(LEDGER_MISSED_TRIGGER) | ONLY(LEDGER_DOUBTFUL));
			assert_int_equal(count(LEDGER_MISSED_TRIGGER), play.length);
			assert_int_equal(count(LEDGER_DOUBTFUL), 3);
			assert_int_equal(ledger.cameras[0].event, LEDGER_MISSED_TRIGGER);
			assert_int_equal(ledger.cameras[0].event_shot, FAULT_SHOT);
		}
}

static void a_dropped_frame_is_named_in_its_very_shot(void **state)
{
	struct play play = ahead(FRAME_DROPPED);

	(void)state;
	for (play.length = 1; play.length <= 4; play.length++) {
		struct outcome out = run(&play);

		assert_int_equal(out.mispaired, 0);
		assert_int_equal(out.taken, SHOTS - play.length);
		expect_only(&play, ONLY(LEDGER_DROPPED));
		assert_int_equal(count(LEDGER_DROPPED), play.length);
		assert_int_equal(ledger.cameras[0].event_shot, FAULT_SHOT);
	}
}

static struct play random_play(struct rng *rng, enum fault fault, uint64_t seed)
{
	return (struct play){.fault = fault,
			     .length = 1 + (uint64_t)(rng_uniform(rng) * 4),
			     .report_ns = random_ns(rng, PERIOD_NS),
			     .report_jitter_ns = random_ns(rng, PERIOD_NS),
			     .arrival_ns = PERIOD_NS / 16 + random_ns(rng, PERIOD_NS),
			     .stamp_jitter_ns = random_ns(rng, PERIOD_NS / 8),
			     .seed = seed};
}

static void any_single_fault_pairs_nothing_wrongly(void **state)
{
	static const uint32_t named[FAULT_COUNT] = {
		[FRAME_DROPPED] = ONLY(LEDGER_DROPPED),
		[FRAME_MISSED] = ONLY(LEDGER_MISSED_TRIGGER) | ONLY(LEDGER_DOUBTFUL),
		[FRAME_REPEATED] = ONLY(LEDGER_REPEATED),
	};
	struct rng rng;

	(void)state;
	rng_init(&rng, 11, 0);
	for (uint64_t seed = 0; seed < 100; seed++)
		for (int fault = 0; fault < FAULT_COUNT; fault++) {
			struct play play = random_play(&rng, (enum fault)fault, seed);
			struct outcome out = run(&play);

			assert_int_equal(out.mispaired, 0);
			assert_true(out.frames - out.taken <= 4);
			expect_only(&play, named[fault]);
			if (named[fault])
				assert_in_range(ledger.cameras[0].event_shot, FAULT_SHOT,
						FAULT_SHOT + play.length - 1);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_pulse_not_fired_is_no_fault_of_a_camera_ahead_of_its_edges),
		cmocka_unit_test(a_missed_trigger_is_named_in_its_very_shot),
		cmocka_unit_test(a_dropped_frame_is_named_in_its_very_shot),
		cmocka_unit_test(any_single_fault_pairs_nothing_wrongly),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
