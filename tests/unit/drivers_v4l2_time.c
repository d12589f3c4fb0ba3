/*
 * From V4L2 time stamps to the middle of the exposure: the truth lies within the bound, and the
 * bound is no wider than what is not known.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>
#include <linux/videodev2.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2_time.h"

#define BEGIN_NS (1000 * NS_PER_S)
#define PERIOD_NS (8333 * NS_PER_US)
#define EXPOSURE_NS (400 * NS_PER_US)
#define READOUT_NS (5 * NS_PER_MS)
#define TRUTH_NS (BEGIN_NS + EXPOSURE_NS / 2)
#define END_NS (BEGIN_NS + EXPOSURE_NS + READOUT_NS)
#define ARRIVAL_NS (END_NS + 50 * NS_PER_US)

enum {
	SOE = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE,
	AT_END = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC
};

static const struct v4l2_timing all_known = {.begin_ns = BEGIN_NS,
					     .period_ns = PERIOD_NS,
					     .exposure_ns = EXPOSURE_NS,
					     .readout_ns = READOUT_NS};

static struct v4l2_stamp stamped(const struct v4l2_timing *timing, uint32_t flags, int64_t stamp_ns)
{
	struct v4l2_stamp stamp = {.flags = flags,
				   .stamp_ns = stamp_ns,
				   .not_yet_ns = ARRIVAL_NS - NS_PER_MS,
				   .arrival_ns = ARRIVAL_NS};

	struct v4l2_timing begun = *timing;

	v4l2_time(&begun, &stamp);
	return stamp;
}

static void assert_true_within(const struct v4l2_stamp *stamp, int64_t bound_ns)
{
	assert_true(llabs(stamp->mid_exposure_ns - TRUTH_NS) <= stamp->uncertainty_ns);
	assert_true(stamp->uncertainty_ns <= bound_ns);
	assert_true(stamp->mid_exposure_ns <= stamp->arrival_ns);
}

static void a_start_of_exposure_is_known_to_the_interrupt(void **state)
{
	(void)state;
	for (int64_t late_ns = 0; late_ns <= 200 * NS_PER_US; late_ns += 50 * NS_PER_US) {
		struct v4l2_stamp stamp = stamped(&all_known, SOE, BEGIN_NS + late_ns);

		assert_true_within(&stamp, 110 * NS_PER_US);
	}
}

static void an_end_of_frame_is_known_to_the_interrupt_where_the_readout_is(void **state)
{
	struct v4l2_stamp stamp = stamped(&all_known, AT_END, END_NS + 45 * NS_PER_US);

	(void)state;
	assert_true_within(&stamp, 110 * NS_PER_US);
}

static void an_unknown_readout_costs_half_a_period(void **state)
{
	(void)state;
	for (int64_t readout_ns = 0; readout_ns <= PERIOD_NS; readout_ns += PERIOD_NS / 8) {
		struct v4l2_timing timing = {.period_ns = PERIOD_NS, .exposure_ns = EXPOSURE_NS};
		struct v4l2_stamp stamp = {.flags = AT_END,
					   .stamp_ns = BEGIN_NS + EXPOSURE_NS + readout_ns,
					   .arrival_ns = BEGIN_NS + EXPOSURE_NS + readout_ns};

		v4l2_time(&timing, &stamp);
		assert_true_within(&stamp, PERIOD_NS / 2 + 110 * NS_PER_US);
	}
}

static void an_unknown_exposure_costs_a_quarter_of_a_period(void **state)
{
	struct v4l2_timing timing = {.period_ns = PERIOD_NS};
	struct v4l2_stamp stamp = stamped(&timing, SOE, BEGIN_NS);

	(void)state;
	assert_true_within(&stamp, PERIOD_NS / 4 + 110 * NS_PER_US);
}

static void first_bytes_come_after_the_exposure(void **state)
{
	struct v4l2_timing timing = all_known;

	(void)state;
	timing.stamps_first_bytes = true;
	for (int64_t late_ns = 0; late_ns <= 4 * NS_PER_MS; late_ns += NS_PER_MS) {
		struct v4l2_stamp stamp = stamped(&timing, SOE, BEGIN_NS + EXPOSURE_NS + late_ns);

		assert_true_within(&stamp, 2010 * NS_PER_US);
	}
}

/* Whatever it says: it is of another clock, or of none. */
static void a_stamp_that_is_not_of_our_clock_is_not_believed(void **state)
{
	static const struct {
		uint32_t flags;
		int64_t stamp_ns;
	} wrong[] = {
		{V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, END_NS},
		{V4L2_BUF_FLAG_TIMESTAMP_COPY, END_NS - PERIOD_NS},
		{SOE, INT64_C(1700000000) * NS_PER_S}, /* the time of day */
		{AT_END, 42},
		{SOE, ARRIVAL_NS + PERIOD_NS},
	};

	(void)state;
	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		struct v4l2_stamp stamp = stamped(&all_known, wrong[i].flags, wrong[i].stamp_ns);

		assert_true_within(&stamp, 510 * NS_PER_US); /* half of what not_yet_ns leaves */
	}
}

/* Frames whose stamps lie so far behind their ends, one after the other. */
static void run_stream(struct v4l2_timing *timing, const int64_t *behind_ns, int count,
		       struct v4l2_stamp *stamps)
{
	v4l2_time_begin(timing, BEGIN_NS);
	for (int i = 0; i < count; i++) {
		int64_t end_ns = END_NS + i * PERIOD_NS;

		stamps[i] = (struct v4l2_stamp){.flags = AT_END,
						.stamp_ns = end_ns + behind_ns[i],
						.not_yet_ns = end_ns - NS_PER_MS,
						.arrival_ns = end_ns + 50 * NS_PER_US};
		v4l2_time(timing, &stamps[i]);
		assert_true(llabs(stamps[i].mid_exposure_ns - TRUTH_NS - i * PERIOD_NS) <=
			    stamps[i].uncertainty_ns);
		assert_true(i == 0 || stamps[i].mid_exposure_ns > stamps[i - 1].mid_exposure_ns);
	}
}

#define STREAM_FRAMES 60

/* Which of them lies when it comes is chance: what a busy machine adds to its arrival. */
static void ends_told_before_they_come_are_believed_of_no_frame(void **state)
{
	struct v4l2_timing timing = all_known;
	int64_t behind_ns[STREAM_FRAMES];
	struct v4l2_stamp stamps[STREAM_FRAMES];

	(void)state;
	for (int i = 0; i < STREAM_FRAMES; i++)
		behind_ns[i] = i % 3 == 1 ? 9 * PERIOD_NS / 10 : 40 * NS_PER_US;
	run_stream(&timing, behind_ns, STREAM_FRAMES, stamps);
	for (int i = 1; i < STREAM_FRAMES; i++)
		assert_in_range(stamps[i].uncertainty_ns, 400 * NS_PER_US, 600 * NS_PER_US);
}

static void a_stream_that_was_believed_stays_so(void **state)
{
	struct v4l2_timing timing = all_known;
	int64_t behind_ns[STREAM_FRAMES] = {0};
	struct v4l2_stamp stamps[STREAM_FRAMES];

	(void)state;
	behind_ns[40] = PERIOD_NS;
	run_stream(&timing, behind_ns, STREAM_FRAMES, stamps);
	for (int i = 0; i < STREAM_FRAMES; i++)
		assert_true((stamps[i].uncertainty_ns > 110 * NS_PER_US) == (i == 40));
}

static void a_new_start_is_tried_anew(void **state)
{
	struct v4l2_timing timing = all_known;
	int64_t behind_ns[1] = {PERIOD_NS};
	struct v4l2_stamp stamp;

	(void)state;
	run_stream(&timing, behind_ns, 1, &stamp);
	assert_true(stamp.uncertainty_ns > 400 * NS_PER_US);
	behind_ns[0] = 0;
	run_stream(&timing, behind_ns, 1, &stamp);
	assert_true(stamp.uncertainty_ns <= 110 * NS_PER_US);
}

/* Two periods, taken with one look: their ways to the middle differ by more than a period. */
static void times_never_run_back(void **state)
{
	struct v4l2_timing timing = {.period_ns = PERIOD_NS};
	struct v4l2_stamp first = {.flags = AT_END,
				   .stamp_ns = 42,
				   .not_yet_ns = ARRIVAL_NS,
				   .arrival_ns = ARRIVAL_NS};
	struct v4l2_stamp second = {.flags = AT_END,
				    .stamp_ns = 42,
				    .not_yet_ns = ARRIVAL_NS - 3 * PERIOD_NS,
				    .arrival_ns = ARRIVAL_NS + NS_PER_US};

	(void)state;
	v4l2_time_begin(&timing, BEGIN_NS);
	v4l2_time(&timing, &first);
	v4l2_time(&timing, &second);
	assert_true(second.mid_exposure_ns > first.mid_exposure_ns);
	assert_true(second.mid_exposure_ns <= second.arrival_ns);
	/* all that was possible of the second still lies within its bound */
	assert_true(second.mid_exposure_ns + second.uncertainty_ns >= second.arrival_ns);
}

static void a_camera_that_tells_nothing_gets_a_wide_bound(void **state)
{
	struct v4l2_timing nothing = {0};
	struct v4l2_stamp stamp = stamped(&nothing, AT_END, END_NS);

	(void)state;
	assert_true_within(&stamp, 31 * NS_PER_MS);
}

/* The truth here is the middle row's: half of the rows behind the first. */
static void a_rolling_shutter_counts_from_its_middle_row(void **state)
{
	static const int64_t readouts_ns[] = {READOUT_NS, 0};
	static const int64_t bounds_ns[] = {110 * NS_PER_US, PERIOD_NS / 4};
	const int64_t rows_ns = READOUT_NS, middle_ns = TRUTH_NS + rows_ns / 2;

	(void)state;
	for (size_t r = 0; r < 2; r++) {
		struct v4l2_timing rolling = all_known;

		rolling.readout_ns = readouts_ns[r];
		rolling.may_roll = true;
		rolling.rows_ns = rows_ns;
		struct v4l2_stamp start = stamped(&rolling, SOE, BEGIN_NS);
		struct v4l2_stamp end = stamped(&rolling, AT_END, END_NS);

		assert_true(llabs(start.mid_exposure_ns - middle_ns) <= start.uncertainty_ns);
		assert_true(start.uncertainty_ns <= 110 * NS_PER_US);
		assert_true(llabs(end.mid_exposure_ns - middle_ns) <= end.uncertainty_ns);
		assert_true(end.uncertainty_ns <= bounds_ns[r]);
	}
}

static void doubt_about_the_shutter_costs_half_of_the_readout(void **state)
{
	struct v4l2_timing doubtful = all_known;

	(void)state;
	doubtful.may_roll = true;
	struct v4l2_stamp start = stamped(&doubtful, SOE, BEGIN_NS);

	assert_true(TRUTH_NS + READOUT_NS / 2 - start.mid_exposure_ns <= start.uncertainty_ns);
	assert_true_within(&start, READOUT_NS / 2 + 110 * NS_PER_US);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_start_of_exposure_is_known_to_the_interrupt),
		cmocka_unit_test(an_end_of_frame_is_known_to_the_interrupt_where_the_readout_is),
		cmocka_unit_test(an_unknown_readout_costs_half_a_period),
		cmocka_unit_test(an_unknown_exposure_costs_a_quarter_of_a_period),
		cmocka_unit_test(first_bytes_come_after_the_exposure),
		cmocka_unit_test(a_stamp_that_is_not_of_our_clock_is_not_believed),
		cmocka_unit_test(ends_told_before_they_come_are_believed_of_no_frame),
		cmocka_unit_test(a_stream_that_was_believed_stays_so),
		cmocka_unit_test(a_new_start_is_tried_anew),
		cmocka_unit_test(times_never_run_back),
		cmocka_unit_test(a_rolling_shutter_counts_from_its_middle_row),
		cmocka_unit_test(doubt_about_the_shutter_costs_half_of_the_readout),
		cmocka_unit_test(a_camera_that_tells_nothing_gets_a_wide_bound),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
