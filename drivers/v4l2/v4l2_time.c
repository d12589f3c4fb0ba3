/*
 * All of it is sums of intervals: what is not known of a length is between its least and its most.
 * Stamps of one stream are believed or not, never now and then: the two ways are off by different
 * amounts, and times that change between them would run back.
 */
#include "drivers/v4l2/v4l2_time.h"

#include <linux/videodev2.h>

#include "base/clock.h"

#define PERIOD_MAX_NS (40 * NS_PER_MS) /* of a camera that tells no rate */
#define INTERRUPT_NS (200 * NS_PER_US) /* from the event to the reading of the clock */
#define FIRST_BYTES_NS (4 * NS_PER_MS) /* a USB transfer of 32 packets, told at its end */
#define STAMP_NS NS_PER_US             /* the stamp's resolution */
#define STAMP_BEFORE_MAX_NS NS_PER_S   /* before the stream began: of another clock */

struct interval {
	int64_t low_ns, high_ns;
};

static struct interval plus(struct interval a, struct interval b)
{
	return (struct interval){a.low_ns + b.low_ns, a.high_ns + b.high_ns};
}

static struct interval minus(struct interval a, struct interval b)
{
	return (struct interval){a.low_ns - b.high_ns, a.high_ns - b.low_ns};
}

static int64_t most(int64_t a_ns, int64_t b_ns)
{
	return a_ns > b_ns ? a_ns : b_ns;
}

static int64_t longest_ns(const struct v4l2_timing *timing)
{
	return timing->period_ns > 0 ? timing->period_ns : PERIOD_MAX_NS;
}

/* Within the period when it is not known. */
static struct interval length_of(int64_t known_ns, const struct v4l2_timing *timing)
{
	return known_ns > 0 ? (struct interval){known_ns, known_ns}
			    : (struct interval){0, longest_ns(timing)};
}

/* From the end of the middle row's exposure to the last pixel. Reading takes as long as the rows at
 * least. */
static struct interval half_readout(const struct v4l2_timing *timing)
{
	struct interval readout = length_of(timing->readout_ns, timing);

	readout.low_ns = most(readout.low_ns, timing->rows_ns);
	readout.high_ns = most(readout.high_ns, readout.low_ns);
	return (struct interval){readout.low_ns - timing->rows_ns / 2,
				 readout.high_ns - timing->rows_ns / 2};
}

/* By how much later than the first row the middle one may have been exposed, where nobody tells. */
static int64_t may_be_later_ns(const struct v4l2_timing *timing)
{
	return timing->may_roll && !timing->rows_ns
		       ? length_of(timing->readout_ns, timing).high_ns / 2
		       : 0;
}

/* Of our clock, and of something that had happened: some devices tell the end of a frame as it was
 * planned, before it comes. */
static bool is_possible(const struct v4l2_timing *timing, const struct v4l2_stamp *stamp)
{
	return (stamp->flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC &&
	       stamp->stamp_ns > timing->begin_ns - STAMP_BEFORE_MAX_NS &&
	       stamp->stamp_ns <= stamp->arrival_ns;
}

/* A stream that was believed stays so; only a stamp that cannot be true is left out then. */
static bool believe(struct v4l2_timing *timing, const struct v4l2_stamp *stamp)
{
	bool possible = is_possible(timing, stamp);

	if (timing->tried < V4L2_TIME_FRAMES) {
		timing->tried++;
		timing->disbelieved |= !possible;
	}
	return possible && !timing->disbelieved;
}

static struct interval middle(const struct v4l2_timing *timing, const struct v4l2_stamp *stamp,
			      bool believed)
{
	struct interval exposure = length_of(timing->exposure_ns, timing);
	struct interval half = {exposure.low_ns / 2, exposure.high_ns / 2};
	struct interval rows = {timing->rows_ns / 2, timing->rows_ns / 2};
	struct interval at = {stamp->not_yet_ns, stamp->arrival_ns};

	if (believed) {
		bool is_start = (stamp->flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) ==
				V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
		int64_t late_ns =
			is_start && timing->stamps_first_bytes ? FIRST_BYTES_NS : INTERRUPT_NS;

		at = (struct interval){stamp->stamp_ns - late_ns, stamp->stamp_ns + STAMP_NS};
		if (is_start && !timing->stamps_first_bytes)
			return plus(plus(at, half), rows);
		if (is_start) /* read out from the end of the exposure on */
			return plus(minus(at, half), rows);
	}
	return minus(minus(at, half_readout(timing)), half);
}

void v4l2_time_begin(struct v4l2_timing *timing, int64_t begin_ns)
{
	timing->begin_ns = begin_ns;
	timing->tried = 0;
	timing->disbelieved = timing->any = false;
}

void v4l2_time(struct v4l2_timing *timing, struct v4l2_stamp *stamp)
{
	struct interval m = middle(timing, stamp, believe(timing, stamp));

	if (m.high_ns > stamp->arrival_ns)
		m.high_ns = stamp->arrival_ns;
	if (m.low_ns > m.high_ns)
		m.low_ns = m.high_ns;
	if (timing->any && timing->last_low_ns <= m.high_ns) /* frames come in order */
		m.low_ns = most(m.low_ns, timing->last_low_ns);
	int64_t middle_ns = m.low_ns + (m.high_ns - m.low_ns) / 2;

	if (timing->any && middle_ns <= timing->last_ns && timing->last_ns < stamp->arrival_ns)
		middle_ns = timing->last_ns + 1;
	timing->any = true;
	timing->last_ns = middle_ns;
	timing->last_low_ns = m.low_ns;
	stamp->mid_exposure_ns = middle_ns;
	m.high_ns += may_be_later_ns(timing);
	if (m.high_ns > stamp->arrival_ns)
		m.high_ns = stamp->arrival_ns;
	stamp->uncertainty_ns = most(m.high_ns - middle_ns, middle_ns - m.low_ns);
}
