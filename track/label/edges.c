/*
 * Pulses stand in order of number and time. Times of frames come from devices: no difference of
 * them may overflow.
 */
#include "track/label/edges.h"

#include <stddef.h>

static const struct pulse *pulse_at(const struct edges *edges, uint64_t index)
{
	return &edges->pulses[index % EDGE_COUNT_MAX];
}

static uint64_t first_index(const struct edges *edges)
{
	return edges->added > EDGE_COUNT_MAX ? edges->added - EDGE_COUNT_MAX : 0;
}

static int64_t elapsed_ns(int64_t from_ns, int64_t to_ns)
{
	int64_t difference_ns;

	if (__builtin_sub_overflow(to_ns, from_ns, &difference_ns))
		return to_ns > from_ns ? INT64_MAX : INT64_MIN;
	return difference_ns;
}

/* Whole periods nearest to a time, away from 0 when halfway. */
static int64_t whole_periods(const struct edges *edges, int64_t time_ns)
{
	int64_t count = time_ns / edges->period_ns, rest_ns = time_ns % edges->period_ns;

	if (rest_ns >= edges->period_ns - rest_ns)
		return count + 1;
	return -rest_ns >= edges->period_ns + rest_ns ? count - 1 : count;
}

bool edges_add(struct edges *edges, uint64_t shot, uint64_t missed, int64_t mid_exposure_ns)
{
	const struct pulse *newest = pulse_at(edges, edges->added - 1);

	if (edges->added && (shot <= newest->shot || mid_exposure_ns <= newest->mid_exposure_ns))
		return false;
	edges->pulses[edges->added++ % EDGE_COUNT_MAX] =
		(struct pulse){shot, mid_exposure_ns, missed};
	if (missed)
		edges->newest_after_gap = shot;
	return true;
}

bool edges_full(const struct edges *edges)
{
	return edges->added - edges->settled >= EDGE_COUNT_MAX / 2;
}

const struct pulse *edges_next(const struct edges *edges)
{
	return edges->settled < edges->added ? pulse_at(edges, edges->settled) : NULL;
}

void edges_settle_next(struct edges *edges)
{
	edges->settled++;
}

enum edges_found edges_nearest(const struct edges *edges, int64_t mid_exposure_ns, uint64_t *shot)
{
	uint64_t first = first_index(edges), i = edges->added;

	if (edges->added == 0)
		return EDGES_NONE;
	while (i > first + 1 && pulse_at(edges, i - 1)->mid_exposure_ns > mid_exposure_ns)
		i--;
	/* i - 1 is the last pulse not after the time, or the first of all; i is the one after it */
	const struct pulse *before = pulse_at(edges, i - 1);
	int64_t after_ns = elapsed_ns(before->mid_exposure_ns, mid_exposure_ns);

	if (i < edges->added) {
		const struct pulse *next = pulse_at(edges, i);
		int64_t early_ns = elapsed_ns(mid_exposure_ns, next->mid_exposure_ns);

		if (early_ns < after_ns && early_ns <= edges->period_ns / 2) {
			*shot = next->shot;
			return EDGES_KNOWN;
		}
	}
	int64_t periods = whole_periods(edges, after_ns);

	if (periods < 0 && (first == 0 || (uint64_t)-periods > before->shot))
		return EDGES_NONE;
	*shot = before->shot + (uint64_t)periods;
	if (periods == 0)
		return EDGES_KNOWN;
	return i == edges->added && periods > 0 ? EDGES_LATER : EDGES_BEHIND;
}

/* Multiples of `stride` behind `shot` that lie in the gap before that pulse, up to `last`. */
static uint64_t in_gap(const struct pulse *pulse, uint64_t shot, uint64_t last, uint32_t stride)
{
	uint64_t begin = pulse->shot - pulse->missed, end = pulse->shot - 1;

	if (pulse->missed == 0 || end <= shot || begin > last)
		return 0;
	if (begin <= shot)
		begin = shot + 1;
	return (end - shot) / stride - (begin - 1 - shot) / stride;
}

uint64_t edges_count_on(const struct edges *edges, uint64_t shot, uint64_t count, uint32_t stride)
{
	uint64_t last = shot + count * stride;

	if (edges->newest_after_gap <= shot)
		return last;
	for (uint64_t i = first_index(edges); i < edges->added; i++)
		last += in_gap(pulse_at(edges, i), shot, last, stride) * stride;
	return last;
}

int64_t edges_time_ns(const struct edges *edges, uint64_t shot)
{
	uint64_t first = first_index(edges), i = edges->added;
	int64_t time_ns;

	if (edges->added == 0)
		return 0;
	while (i > first + 1 && pulse_at(edges, i - 1)->shot > shot)
		i--;
	const struct pulse *pulse = pulse_at(edges, i - 1);
	int64_t periods = (int64_t)(shot - pulse->shot);

	if (__builtin_mul_overflow(periods, edges->period_ns, &time_ns) ||
	    __builtin_add_overflow(time_ns, pulse->mid_exposure_ns, &time_ns))
		return pulse->mid_exposure_ns;
	return time_ns;
}
