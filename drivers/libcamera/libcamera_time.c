/*
 * Every meaning that a stamp may still have gives an interval for the middle of the exposure; the
 * answer covers all of them. A frame: rows collect light for an exposure, are read out for a
 * read-out (a rolling shutter's rows one after another), and the picture arrives.
 */
#include "drivers/libcamera/libcamera_time.h"

#include "base/clock.h"

#define PERIOD_MAX_NS (40 * NS_PER_MS) /* of a camera that tells no rate */
#define INTERRUPT_NS (200 * NS_PER_US) /* from the event to the reading of the clock */
#define PATH_NS (5 * NS_PER_MS)        /* from the last pixel to us, where no stamp tells */
#define AT_END_NS (1 * NS_PER_MS)      /* a stamp so shortly before the arrival marks the end */
#define BEFORE_MAX_NS NS_PER_S         /* before the stream began: of another clock */

struct interval {
	int64_t low_ns, high_ns;
};

/* What is not known is within a period. */
static struct interval length_of(int64_t known_ns, const struct libcamera_timing *timing)
{
	int64_t most_ns = timing->period_ns > 0 ? timing->period_ns : PERIOD_MAX_NS;

	return known_ns > 0 ? (struct interval){known_ns, known_ns} : (struct interval){0, most_ns};
}

/* On CLOCK_MONOTONIC; 0 when there is none that can be true. */
static int64_t possible_stamp(const struct libcamera_timing *timing,
			      const struct libcamera_stamp *stamp)
{
	int64_t at_ns = stamp->stamp_ns;

	if (at_ns > stamp->arrival_ns)
		at_ns -= timing->boot_offset_ns;
	return at_ns > timing->begin_ns - BEFORE_MAX_NS && at_ns <= stamp->arrival_ns ? at_ns : 0;
}

static void learn(struct libcamera_timing *timing, int64_t lag_ns)
{
	if (timing->tried == LIBCAMERA_TIME_FRAMES)
		return;
	if (timing->tried++ == 0 || lag_ns < timing->least_lag_ns)
		timing->least_lag_ns = lag_ns;
}

/* The picture was there sooner than it could have been read out. */
static bool marks_end(const struct libcamera_timing *timing)
{
	int64_t limit_ns = timing->readout_ns > 0 ? timing->readout_ns / 2 : AT_END_NS;

	return timing->least_lag_ns < limit_ns;
}

/* ... or exposed and read out: then it is no beginning of an exposure, as libcamera has it. */
static bool may_mark_exposure(const struct libcamera_timing *timing, struct interval exposure)
{
	return timing->least_lag_ns >= exposure.low_ns + timing->readout_ns;
}

static void widen(struct interval *all, int64_t low_ns, int64_t high_ns)
{
	if (low_ns < all->low_ns)
		all->low_ns = low_ns;
	if (high_ns > all->high_ns)
		all->high_ns = high_ns;
}

static int64_t most(int64_t a_ns, int64_t b_ns)
{
	return a_ns > b_ns ? a_ns : b_ns;
}

/* Reading takes as long as the rows at least. */
static struct interval readout_of(const struct libcamera_timing *timing)
{
	struct interval readout = length_of(timing->readout_ns, timing);

	readout.low_ns = most(readout.low_ns, timing->rows_ns);
	readout.high_ns = most(readout.high_ns, readout.low_ns);
	return readout;
}

/* By how much later than the first row the middle one is exposed, of that readout. */
static struct interval later(const struct libcamera_timing *timing, int64_t readout_ns)
{
	int64_t half_ns = timing->rows_ns / 2;

	return (struct interval){half_ns, timing->may_roll ? readout_ns / 2 : half_ns};
}

/* The middle row's exposure ended that long before the last pixel was read. */
static struct interval before_end(const struct libcamera_timing *timing)
{
	struct interval readout = readout_of(timing);

	return (struct interval){readout.low_ns - later(timing, readout.low_ns).high_ns,
				 readout.high_ns - later(timing, readout.high_ns).low_ns};
}

/* Middle of the middle row, for a stamp that is an interrupt late at most. */
static struct interval middle(const struct libcamera_timing *timing, struct interval exposure,
			      int64_t at_ns)
{
	struct interval row = later(timing, readout_of(timing).high_ns);
	struct interval read = before_end(timing);
	int64_t first_ns = at_ns - INTERRUPT_NS;
	struct interval end = {first_ns - read.high_ns - exposure.high_ns / 2,
			       at_ns - read.low_ns - exposure.low_ns / 2};
	struct interval all = {first_ns + row.low_ns - exposure.high_ns / 2,
			       at_ns + row.high_ns - exposure.low_ns / 2};

	if (timing->tried == LIBCAMERA_TIME_FRAMES && marks_end(timing))
		return end;
	if (may_mark_exposure(timing, exposure))
		widen(&all, first_ns + row.low_ns + exposure.low_ns / 2,
		      at_ns + row.high_ns + exposure.high_ns / 2);
	if (timing->tried < LIBCAMERA_TIME_FRAMES)
		widen(&all, end.low_ns, end.high_ns);
	return all;
}

void libcamera_time_begin(struct libcamera_timing *timing, int64_t begin_ns)
{
	timing->begin_ns = begin_ns;
	timing->tried = 0;
	timing->any = false;
}

static struct interval without_stamp(const struct libcamera_timing *timing,
				     struct interval exposure, int64_t arrival_ns)
{
	struct interval read = before_end(timing);

	return (struct interval){arrival_ns - PATH_NS - read.high_ns - exposure.high_ns / 2,
				 arrival_ns - read.low_ns - exposure.low_ns / 2};
}

void libcamera_time(struct libcamera_timing *timing, struct libcamera_stamp *stamp)
{
	struct interval exposure = length_of(
		stamp->exposure_ns > 0 ? stamp->exposure_ns : timing->exposure_ns, timing);
	int64_t at_ns = possible_stamp(timing, stamp);
	struct interval m;

	if (at_ns)
		learn(timing, stamp->arrival_ns - at_ns);
	m = at_ns ? middle(timing, exposure, at_ns)
		  : without_stamp(timing, exposure, stamp->arrival_ns);
	if (m.high_ns > stamp->arrival_ns)
		m.high_ns = stamp->arrival_ns;
	if (m.low_ns > m.high_ns)
		m.low_ns = m.high_ns;
	int64_t middle_ns = m.low_ns + (m.high_ns - m.low_ns) / 2;

	if (timing->any && middle_ns <= timing->last_ns && timing->last_ns < stamp->arrival_ns)
		middle_ns = timing->last_ns + 1;
	timing->any = true;
	timing->last_ns = middle_ns;
	stamp->mid_exposure_ns = middle_ns;
	stamp->uncertainty_ns = m.high_ns - middle_ns > middle_ns - m.low_ns ? m.high_ns - middle_ns
									     : middle_ns - m.low_ns;
}
