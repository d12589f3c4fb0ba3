/*
 * Two looks at one counter: how long it stands still, and whether it moved between two kicks.
 */
#include "daemon/heartbeat.h"

static uint64_t beats_of(const struct heartbeat *heartbeat)
{
	return atomic_load_explicit(&heartbeat->beats, memory_order_relaxed);
}

static bool is_expected(const struct heartbeat *heartbeat)
{
	return heartbeat->expected && !atomic_load_explicit(&heartbeat->over, memory_order_relaxed);
}

void heartbeat_expect(struct heartbeat *heartbeat, int64_t now_ns)
{
	heartbeat->seen_beats = heartbeat->kicked_beats = beats_of(heartbeat);
	heartbeat->moved_ns = now_ns;
	atomic_store(&heartbeat->over, false);
	heartbeat->expected = true;
}

void heartbeat_forget(struct heartbeat *heartbeat)
{
	heartbeat->expected = false;
}

int64_t heartbeat_still_ns(struct heartbeat *heartbeat, int64_t now_ns)
{
	uint64_t beats = beats_of(heartbeat);

	if (!is_expected(heartbeat))
		return 0;
	if (beats != heartbeat->seen_beats) {
		heartbeat->seen_beats = beats;
		heartbeat->moved_ns = now_ns;
		return 0;
	}
	return now_ns - heartbeat->moved_ns;
}

bool heartbeat_moved(const struct heartbeat *heartbeat)
{
	return !is_expected(heartbeat) || beats_of(heartbeat) != heartbeat->kicked_beats;
}

void heartbeat_kicked(struct heartbeat *heartbeat)
{
	heartbeat->kicked_beats = beats_of(heartbeat);
}
