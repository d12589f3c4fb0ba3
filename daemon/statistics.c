/*
 * Differences of counters over the seconds, histograms of latencies.
 */
#include "daemon/statistics.h"

#include <string.h>

#include "base/clock.h"

static const char *const stage_names[LATENCY_STAGE_COUNT] = {
	[LATENCY_LIGHT_TO_ARRIVAL] = "light_to_arrival",
	[LATENCY_ARRIVAL_TO_BLOBS] = "arrival_to_blobs",
	[LATENCY_BLOBS_TO_SOLVED] = "blobs_to_solved",
	[LATENCY_SOLVED_TO_SENT] = "solved_to_sent",
	[LATENCY_ARRIVAL_TO_SENT] = "arrival_to_sent",
	[LATENCY_LIGHT_TO_SENT] = "light_to_sent",
};

const char *latency_stage_name(enum latency_stage stage)
{
	return stage_names[stage];
}

static void add(struct statistics *statistics, enum latency_stage stage, int64_t from_ns,
		int64_t to_ns)
{
	histogram_add(&statistics->latencies[stage].run, to_ns - from_ns);
	histogram_add(&statistics->latencies[stage].recent, to_ns - from_ns);
}

void statistics_add_set(struct statistics *statistics, const struct marker_set *set,
			int64_t sent_ns)
{
	if (set->arrival_ns <= 0)
		return; /* no camera was in it */
	add(statistics, LATENCY_LIGHT_TO_ARRIVAL, set->mid_exposure_ns, set->arrival_ns);
	add(statistics, LATENCY_ARRIVAL_TO_BLOBS, set->arrival_ns, set->found_ns);
	add(statistics, LATENCY_BLOBS_TO_SOLVED, set->found_ns, set->solved_ns);
	add(statistics, LATENCY_SOLVED_TO_SENT, set->solved_ns, sent_ns);
	add(statistics, LATENCY_ARRIVAL_TO_SENT, set->arrival_ns, sent_ns);
	add(statistics, LATENCY_LIGHT_TO_SENT, set->mid_exposure_ns, sent_ns);
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

static void change_window(struct statistics *statistics, int64_t now_ns)
{
	if (now_ns - statistics->window_ns < LATENCY_RECENT_S * NS_PER_S)
		return;
	statistics->window_ns = now_ns;
	for (int s = 0; s < LATENCY_STAGE_COUNT; s++) {
		struct latency *latency = &statistics->latencies[s];

		latency->before = latency->recent;
		memset(&latency->recent, 0, sizeof(latency->recent));
	}
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
	change_window(statistics, now_ns);
}

void latency_recent(const struct latency *latency, struct histogram *out)
{
	*out = latency->recent;
	histogram_merge(out, &latency->before);
}
