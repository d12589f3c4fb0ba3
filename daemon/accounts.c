/*
 * The causes of losses are named here and nowhere else; docs/operators-guide.md explains them.
 */
#include "daemon/accounts.h"

#include <stddef.h>

#include "base/clock.h"
#include "daemon/watchdog.h"
#include "sim/world/world.h"

#define CAUSE(name)                                            \
	{                                                      \
#name, offsetof(struct capture_counters, name) \
	}

static const struct {
	const char *cause;
	size_t offset;
} causes[] = {
	CAUSE(damaged),     CAUSE(wrong_size), CAUSE(wrong_time),
	CAUSE(device_gaps), CAUSE(refused),    CAUSE(before_start),
	CAUSE(stale),       CAUSE(timeouts),   CAUSE(blobs_lost),
};

#define CAUSE_COUNT (sizeof(causes) / sizeof(causes[0]))
_Static_assert(CAUSE_COUNT <= STREAM_COUNT_MAX && LEDGER_EVENT_COUNT <= STREAM_COUNT_MAX,
	       "more causes than a message holds");
_Static_assert((int)PULSE_EVENT_COUNT <= (int)STREAM_COUNT_MAX,
	       "more events of a trigger than a message holds");
_Static_assert((int)LATENCY_STAGE_COUNT <= (int)STREAM_LATENCY_MAX,
	       "more stages than a message holds");

static struct stream_queue queue_of(const struct ring *ring)
{
	return (struct stream_queue){ring_count(ring), ring_fill_max(ring), ring->capacity};
}

static void fill_camera(const struct station *station, uint32_t index,
			struct stream_camera_statistics *out)
{
	const struct capture *capture = &station->captures[index];
	const struct capture_counters *counters = &capture->counters;
	const struct camera_events *events = &station->solver.book.cameras[index];

	out->state = capture_state_name(atomic_load(&capture->state));
	out->frames = atomic_load(&counters->frames);
	out->missing = atomic_load(&counters->missing);
	out->blobs_masked = atomic_load(&counters->blobs_masked);
	out->reopened = atomic_load(&counters->reopened);
	out->queue = queue_of(capture->role == ROLE_IR ? &capture->sets : &capture->hd.notes);
	out->loss_count = CAUSE_COUNT;
	for (size_t i = 0; i < CAUSE_COUNT; i++) {
		const char *counter = (const char *)counters + causes[i].offset;

		out->losses[i] = (struct stream_count){
			causes[i].cause,
			atomic_load((const _Atomic uint64_t *)(const void *)counter)};
	}
	out->moved_px = atomic_load(&events->moved_px);
	out->moved_mrad = atomic_load(&events->moved_mrad);
	out->event_count = LEDGER_EVENT_COUNT;
	for (int e = 0; e < LEDGER_EVENT_COUNT; e++)
		out->events[e] = (struct stream_count){ledger_event_name((enum ledger_event)e),
						       atomic_load(&events->counts[e])};
}

static struct stream_percentiles percentiles(const struct histogram *histogram)
{
	return (struct stream_percentiles){
		.count = histogram->count,
		.p50_ns = histogram_part_ns(histogram, 0.5),
		.p90_ns = histogram_part_ns(histogram, 0.9),
		.p99_ns = histogram_part_ns(histogram, 0.99),
		.max_ns = histogram->max_ns,
	};
}

static void fill_latency(const struct statistics *statistics, enum latency_stage stage,
			 struct stream_latency *out)
{
	const struct latency *latency = &statistics->latencies[stage];
	struct histogram recent;

	latency_recent(latency, &recent);
	*out = (struct stream_latency){.stage = latency_stage_name(stage),
				       .run = percentiles(&latency->run),
				       .recent = percentiles(&recent)};
}

static void fill_pulses(const struct pulses *pulses, struct stream_pulses *out)
{
	const struct pulse_accounts *accounts = &pulses->accounts;

	*out = (struct stream_pulses){.lost = atomic_load(&pulses->lost),
				      .missed = accounts->missed,
				      .reopened = accounts->reopened,
				      .late = percentiles(&accounts->late),
				      .event_count = PULSE_EVENT_COUNT};
	for (int e = 0; e < PULSE_EVENT_COUNT; e++)
		out->events[e] = (struct stream_count){pulse_event_name((enum pulse_event)e),
						       accounts->events[e]};
}

/* Returns false while what the cameras see has names. */
static bool fill_unnamed(const struct station *station, struct stream_unnamed *out)
{
	const struct names_seen *names = &station->solver.book.names;

	*out = (struct stream_unnamed){
		.seconds = station_unnamed_s(station),
		.spots = atomic_load(&names->spots),
		.points = atomic_load(&names->points),
		.named = atomic_load(&names->named),
		.remedy = naming_remedy((enum naming)atomic_load(&names->naming))};
	return out->seconds > 0 && out->remedy;
}

uint64_t sim_late_since_open(const struct station *station)
{
	uint64_t late = 0;

	if (!station->world_open)
		return 0;
	uint32_t count =
		sim_scene_camera_count(sim_world_scene()) + sim_scene_hd_count(sim_world_scene());

	for (uint32_t c = 0; c < count; c++)
		late += sim_world_late_count(c);
	return late;
}

void station_accounts(struct station *station, struct stream_statistics *out)
{
	*out = (struct stream_statistics){
		.time_ns = clock_now_ns(),
		.state = station_state_name(station->state),
		.run = station->run,
		.shots_per_s = station->statistics.shots_per_s,
		.shots_solved = atomic_load(&station->solver.shots),
		.shots_incomplete = atomic_load(&station->solver.incomplete),
		.shots_lost = atomic_load(&station->solver.lost),
		.sim_late = sim_late_since_open(station) - station->sim_late_before,
		.edges_refused = atomic_load(&station->pulses.edges_refused),
		.edges = queue_of(&station->pulses.edges),
		.sets = queue_of(&station->solver.sets),
		.camera_count = station->stage.config.camera_count,
		.latency_count = LATENCY_STAGE_COUNT,
	};
	out->has_pulses = station->pulses.driver && station->pulses.driver->reports_edges;
	if (out->has_pulses)
		fill_pulses(&station->pulses, &out->pulses);
	for (uint32_t c = 0; c < out->camera_count; c++)
		fill_camera(station, c, &out->cameras[c]);
	for (int s = 0; s < LATENCY_STAGE_COUNT; s++)
		fill_latency(&station->statistics, (enum latency_stage)s, &out->latencies[s]);
	out->stall_count = find_stalls(station, out->time_ns, out->stalls);
	out->has_unnamed = fill_unnamed(station, &out->unnamed);
}
