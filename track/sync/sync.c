/*
 * Sync: fronts of queues in, the next shot out. With edges a front belongs to the edge nearest to
 * it; without, fronts with the same shot number or within half a period of the earliest are one
 * shot. Times and numbers come from files and devices: no difference of them may overflow.
 */
#include "track/sync/sync.h"

#include <string.h>

/* The widest half period while the period is only learned: fits every rate up to 250 Hz. */
#define LEARNING_WINDOW_NS INT64_C(2000000)

static int64_t elapsed_ns(int64_t from, int64_t to)
{
	int64_t difference;

	if (__builtin_sub_overflow(to, from, &difference))
		return to > from ? INT64_MAX : INT64_MIN;
	return difference;
}

static int64_t window_ns(const struct sync *sync)
{
	int64_t half = sync->period_ns / 2;

	if (sync->period_ns <= 0)
		return LEARNING_WINDOW_NS;
	return sync->period_learned && half > LEARNING_WINDOW_NS ? LEARNING_WINDOW_NS : half;
}

static bool within(int64_t a_ns, int64_t b_ns, int64_t limit_ns)
{
	int64_t apart = elapsed_ns(a_ns, b_ns);

	return apart <= limit_ns && apart >= -limit_ns;
}

/* At or before the last closed shot. */
static bool front_closed(const struct sync *sync, const struct front *front)
{
	if (!sync->started)
		return false;
	if (front->shot != SHOT_UNKNOWN)
		return front->shot <= sync->last_shot;
	return elapsed_ns(sync->last_mid_exposure_ns, front->mid_exposure_ns) <= window_ns(sync);
}

/* Of a closed shot; without a number: nearer to the last shot than to this edge, or more than half
 * a period before it. */
static bool front_before_edge(const struct sync *sync, const struct front *front,
			      const struct front *edge)
{
	if (front->shot != SHOT_UNKNOWN)
		return sync->started && front->shot <= sync->last_shot;
	int64_t early = elapsed_ns(front->mid_exposure_ns, edge->mid_exposure_ns);

	if (early > window_ns(sync))
		return true;
	return sync->started && early > 0 &&
	       elapsed_ns(sync->last_mid_exposure_ns, front->mid_exposure_ns) < early;
}

static uint32_t stale_fronts(const struct sync *sync, const struct front *fronts, uint32_t count,
			     const struct front *edge)
{
	uint32_t mask = 0;

	for (uint32_t c = 0; c < count; c++) {
		if (fronts[c].state != FRONT_READY)
			continue;
		if (edge ? front_before_edge(sync, &fronts[c], edge)
			 : front_closed(sync, &fronts[c]))
			mask |= UINT32_C(1) << c;
	}
	return mask;
}

/* By number where both have one, else by time. */
static bool front_before(const struct front *a, const struct front *b)
{
	if (a->shot != SHOT_UNKNOWN && b->shot != SHOT_UNKNOWN && a->shot != b->shot)
		return a->shot < b->shot;
	return a->mid_exposure_ns < b->mid_exposure_ns;
}

static const struct front *first_front(const struct front *fronts, uint32_t count, bool numbered)
{
	const struct front *first = NULL;

	for (uint32_t c = 0; c < count; c++)
		if (fronts[c].state == FRONT_READY &&
		    (fronts[c].shot != SHOT_UNKNOWN) == numbered &&
		    (!first || front_before(&fronts[c], first)))
			first = &fronts[c];
	return first;
}

/* Fronts of the shot that `lead` opens; `number` is its number or SHOT_UNKNOWN. */
static uint32_t members_of(const struct sync *sync, const struct front *fronts, uint32_t count,
			   const struct front *lead, uint64_t number)
{
	uint32_t mask = 0;

	for (uint32_t c = 0; c < count; c++) {
		const struct front *front = &fronts[c];
		bool same_number = front->shot != SHOT_UNKNOWN && front->shot == number;
		bool near = within(lead->mid_exposure_ns, front->mid_exposure_ns, window_ns(sync));
		bool other_number = front->shot != SHOT_UNKNOWN && front->shot != number;

		if (front->state == FRONT_READY &&
		    ((same_number && lead->shot == number) || (near && !other_number)))
			mask |= UINT32_C(1) << c;
	}
	return mask;
}

static int64_t mean_mid_exposure_ns(const struct front *fronts, uint32_t members)
{
	int64_t first = fronts[__builtin_ctz(members)].mid_exposure_ns;
	__int128 sum = 0;

	for (uint32_t left = members; left; left &= left - 1)
		sum += (__int128)fronts[__builtin_ctz(left)].mid_exposure_ns - first;
	return (int64_t)(first + sum / __builtin_popcount(members));
}

/* The lower median: one clock that went astray has no say in it. */
static int64_t middle_mid_exposure_ns(const struct front *fronts, uint32_t members)
{
	int64_t sorted[CAMERA_MAX];
	int count = 0;

	for (uint32_t left = members; left; left &= left - 1) {
		int64_t time_ns = fronts[__builtin_ctz(left)].mid_exposure_ns;
		int at = count++;

		for (; at > 0 && sorted[at - 1] > time_ns; at--)
			sorted[at] = sorted[at - 1];
		sorted[at] = time_ns;
	}
	return sorted[(count - 1) / 2];
}

/* The time of a shot with members; names those whose times are another shot's. */
static void set_time(const struct sync *sync, const struct front *fronts, struct sync_decision *out)
{
	int64_t middle_ns = middle_mid_exposure_ns(fronts, out->member_mask);

	for (uint32_t left = out->member_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		if (!within(middle_ns, fronts[c].mid_exposure_ns, window_ns(sync)))
			out->off_time_mask |= UINT32_C(1) << c;
	}
	out->mid_exposure_ns = mean_mid_exposure_ns(fronts, out->member_mask & ~out->off_time_mask);
}

/* Periods from the last shot to this time, at least 1; learns the period on the way. */
static uint64_t periods_since_last(struct sync *sync, int64_t mid_exposure_ns)
{
	int64_t gap = elapsed_ns(sync->last_mid_exposure_ns, mid_exposure_ns);

	if (gap <= 0)
		return 1;
	if (sync->period_ns <= 0 || (sync->period_learned && gap < sync->period_ns / 4 * 3)) {
		sync->period_learned = true;
		sync->period_ns = gap;
	}
	uint64_t periods =
		((uint64_t)gap + (uint64_t)sync->period_ns / 2) / (uint64_t)sync->period_ns;
	if (sync->period_learned && periods <= 1)
		sync->period_ns += (gap - sync->period_ns) / 8;
	return periods > 1 ? periods : 1;
}

/* Numbers in shots run on from the last; the first of a source without numbers is 0. */
static enum sync_result close_shot(struct sync *sync, uint32_t camera_count, uint64_t number,
				   struct sync_decision *out)
{
	uint32_t all = camera_count < 32 ? (UINT32_C(1) << camera_count) - 1 : UINT32_MAX;

	if (number == SHOT_UNKNOWN)
		number = sync->started
				 ? sync->last_shot + periods_since_last(sync, out->mid_exposure_ns)
				 : 0;
	out->shot = number;
	out->missing_mask = all & ~out->member_mask;
	sync->started = true;
	sync->last_shot = number;
	sync->last_mid_exposure_ns = out->mid_exposure_ns;
	return SYNC_SHOT;
}

static enum sync_result next_from_fronts(struct sync *sync, const struct front *fronts,
					 uint32_t count, struct sync_decision *out)
{
	const struct front *numbered = first_front(fronts, count, true);
	const struct front *timed = first_front(fronts, count, false);
	const struct front *lead =
		!timed || (numbered && numbered->mid_exposure_ns <= timed->mid_exposure_ns)
			? numbered
			: timed;
	uint64_t number = numbered ? numbered->shot : SHOT_UNKNOWN;

	if (!lead)
		return SYNC_WAIT;
	if (lead == timed && numbered &&
	    !within(lead->mid_exposure_ns, numbered->mid_exposure_ns, window_ns(sync)))
		number = SHOT_UNKNOWN; /* the numbered ones are of a later shot */
	out->member_mask = members_of(sync, fronts, count, lead, number);
	set_time(sync, fronts, out);
	return close_shot(sync, count, number, out);
}

static enum sync_result next_from_edge(struct sync *sync, const struct front *fronts,
				       uint32_t count, const struct front *edge,
				       struct sync_decision *out)
{
	for (uint32_t c = 0; c < count; c++) {
		const struct front *front = &fronts[c];
		bool member = front->shot != SHOT_UNKNOWN
				      ? front->shot == edge->shot
				      : within(edge->mid_exposure_ns, front->mid_exposure_ns,
					       window_ns(sync));

		if (front->state == FRONT_READY && member)
			out->member_mask |= UINT32_C(1) << c;
	}
	out->mid_exposure_ns = edge->mid_exposure_ns;
	if (out->member_mask)
		set_time(sync, fronts, out);
	out->edge_used = true;
	return close_shot(sync, count, edge->shot, out);
}

static bool any_front(const struct front *fronts, uint32_t count, enum front_state state)
{
	for (uint32_t c = 0; c < count; c++)
		if (fronts[c].state == state)
			return true;
	return false;
}

enum sync_result sync_next(struct sync *sync, const struct front *fronts, uint32_t camera_count,
			   const struct front *edge, bool expired, struct sync_decision *out)
{
	bool edge_ready = edge && edge->state == FRONT_READY;

	memset(out, 0, sizeof(*out));
	if (!any_front(fronts, camera_count, FRONT_READY) &&
	    !any_front(fronts, camera_count, FRONT_WAITING))
		return SYNC_END;
	out->edge_used = edge_ready && sync->started && edge->shot <= sync->last_shot;
	if (out->edge_used)
		return SYNC_STALE;
	out->stale_mask = stale_fronts(sync, fronts, camera_count, edge_ready ? edge : NULL);
	if (out->stale_mask)
		return SYNC_STALE;
	bool waiting = any_front(fronts, camera_count, FRONT_WAITING) ||
		       (edge && edge->state == FRONT_WAITING);
	if (waiting && !expired)
		return SYNC_WAIT;
	/* a pulse that was not reported, but seen by cameras, is a shot as well */
	const struct front *first = first_front(fronts, camera_count, true);
	bool unreported = edge_ready && first && first->shot < edge->shot;

	return edge_ready && !unreported ? next_from_edge(sync, fronts, camera_count, edge, out)
					 : next_from_fronts(sync, fronts, camera_count, out);
}
