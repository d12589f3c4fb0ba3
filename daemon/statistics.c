/*
 * Differences of counters over the seconds, percentiles of a window.
 */
#include "daemon/statistics.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

void statistics_add_set(struct statistics *statistics, const struct marker_set *set)
{
	if (set->arrival_ns <= 0)
		return; /* no camera was in it */
	statistics->latency_ns[statistics->latency_count++ % LATENCY_WINDOW] =
		set->solved_ns - set->arrival_ns;
}

static void update_camera(struct camera_rate *rate, const struct capture *capture, double passed_s)
{
	uint64_t frames = atomic_load(&capture->counters.frames);
	uint64_t blobs = atomic_load(&capture->counters.blobs);
	uint64_t more = frames - rate->frames_before;

	rate->frames_per_s = (double)more / passed_s;
	rate->blobs_per_frame = more ? (double)(blobs - rate->blobs_before) / (double)more : 0;
	rate->frames_before = frames;
	rate->blobs_before = blobs;
}

void statistics_update(struct statistics *statistics, const struct capture *captures,
		       uint32_t count, uint64_t shots, int64_t now_ns)
{
	double passed_s = (double)(now_ns - statistics->last_ns) / NS_PER_S;

	if (passed_s <= 0)
		return;
	for (uint32_t c = 0; c < count; c++)
		update_camera(&statistics->cameras[c], &captures[c], passed_s);
	statistics->shots_per_s = (double)(shots - statistics->shots_before) / passed_s;
	statistics->shots_before = shots;
	statistics->last_ns = now_ns;
}

static int compare_ns(const void *a, const void *b)
{
	int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

	return (x > y) - (x < y);
}

int64_t statistics_latency_ns(const struct statistics *statistics, double part)
{
	uint64_t count = statistics->latency_count < LATENCY_WINDOW ? statistics->latency_count
								    : LATENCY_WINDOW;
	int64_t sorted[LATENCY_WINDOW];

	if (count == 0)
		return 0;
	memcpy(sorted, statistics->latency_ns, count * sizeof(sorted[0]));
	qsort(sorted, count, sizeof(sorted[0]), compare_ns);
	return sorted[(uint64_t)(part * (double)(count - 1) + 0.5)];
}
