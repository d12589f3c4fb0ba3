/*
 * Keeps the newest frame of each camera until they meet. Real-time safe.
 */
#include "daemon/warm_up.h"

#include "base/clock.h"

#define GIVE_UP_NS NS_PER_S

static const struct blob_set *front_set(struct capture *capture)
{
	return capture->role == ROLE_IR ? ring_peek(&capture->sets, 0) : NULL;
}

static void drop_front(struct capture *capture)
{
	ring_pop(&capture->sets);
	atomic_fetch_add_explicit(&capture->counters.before_start, 1, memory_order_relaxed);
}

/* The time of the newest front, with all but the newest frame of each camera dropped. */
static int64_t keep_newest(struct capture *captures, uint32_t count)
{
	int64_t newest_ns = INT64_MIN;

	for (uint32_t c = 0; c < count; c++) {
		if (captures[c].role != ROLE_IR)
			continue;
		while (ring_peek(&captures[c].sets, 1))
			drop_front(&captures[c]);
		const struct blob_set *set = front_set(&captures[c]);
		if (set && set->mid_exposure_ns > newest_ns)
			newest_ns = set->mid_exposure_ns;
	}
	return newest_ns;
}

/* True when every running camera has a frame within half a period of the newest. */
static bool all_meet(struct capture *captures, uint32_t count, int64_t newest_ns, int64_t period_ns)
{
	bool meet = true;

	for (uint32_t c = 0; c < count; c++) {
		const struct blob_set *set = front_set(&captures[c]);

		if (set && newest_ns - set->mid_exposure_ns > period_ns / 2) {
			drop_front(&captures[c]);
			set = NULL;
		}
		if (!set && captures[c].role == ROLE_IR)
			meet = false;
	}
	return meet;
}

/* Recordings number their shots: theirs begin with the first of any camera. */
static bool numbered(struct capture *captures, uint32_t count)
{
	for (uint32_t c = 0; c < count; c++) {
		const struct blob_set *set = front_set(&captures[c]);

		if (set && set->shot != SHOT_UNKNOWN)
			return true;
	}
	return false;
}

bool warm_up_step(struct warm_up *warm_up, struct capture *captures, uint32_t count,
		  int64_t period_ns, int64_t now_ns)
{
	if (warm_up->done)
		return true;
	if (numbered(captures, count)) {
		warm_up->done = true;
		return true;
	}
	int64_t newest_ns = keep_newest(captures, count);
	if (newest_ns == INT64_MIN)
		return false;
	if (warm_up->begin_ns == 0)
		warm_up->begin_ns = now_ns;
	warm_up->done = all_meet(captures, count, newest_ns, period_ns) ||
			now_ns - warm_up->begin_ns > GIVE_UP_NS;
	return warm_up->done;
}
