/*
 * The message Statistics. Absent sub-messages read as zeros.
 */
#include <errno.h>

#include "protocol/decode_parts.h"

#define CAMERAS_MAX 1024
#define COUNTS_MAX 1024
#define LATENCIES_MAX 1024
#define STALLS_MAX 1024

static struct stage_queue decode_queue(const Stage__V1__Queue *from)
{
	if (!from)
		return (struct stage_queue){0};
	return (struct stage_queue){from->filled, from->filled_max, from->capacity};
}

static int decode_counts(void *arena, Stage__V1__Count *const *from, size_t count,
			 const struct stage_count **out, uint32_t *out_count)
{
	struct stage_count *counts = decode_alloc(arena, count * sizeof(*counts));

	if (count > COUNTS_MAX || !counts)
		return -EPROTO;
	for (size_t i = 0; i < count; i++) {
		if (!decode_text_is_clean(from[i]->cause))
			return -EPROTO;
		counts[i] = (struct stage_count){from[i]->cause, from[i]->count};
	}
	*out = counts;
	*out_count = (uint32_t)count;
	return 0;
}

static int decode_camera(void *arena, const Stage__V1__CameraStatistics *from,
			 struct stage_camera_statistics *to)
{
	*to = (struct stage_camera_statistics){.state = from->state,
					       .frames = from->frames,
					       .missing = from->missing,
					       .blobs_masked = from->blobs_masked,
					       .reopened = from->reopened,
					       .queue = decode_queue(from->queue),
					       .moved_px = from->moved_px,
					       .moved_mrad = from->moved_mrad};
	if (!decode_text_is_clean(from->state) ||
	    decode_counts(arena, from->losses, from->n_losses, &to->losses, &to->loss_count) < 0)
		return -EPROTO;
	return decode_counts(arena, from->events, from->n_events, &to->events, &to->event_count);
}

static int decode_cameras(void *arena, const Stage__V1__Statistics *from,
			  struct stage_statistics *to)
{
	struct stage_camera_statistics *cameras =
		decode_alloc(arena, from->n_cameras * sizeof(*cameras));

	if (from->n_cameras > CAMERAS_MAX || !cameras)
		return -EPROTO;
	for (size_t c = 0; c < from->n_cameras; c++)
		if (decode_camera(arena, from->cameras[c], &cameras[c]) < 0)
			return -EPROTO;
	to->camera_count = (uint32_t)from->n_cameras;
	to->cameras = cameras;
	return 0;
}

static struct stage_percentiles decode_percentiles(const Stage__V1__Percentiles *from)
{
	if (!from)
		return (struct stage_percentiles){0};
	return (struct stage_percentiles){from->count, from->p50_ns, from->p90_ns, from->p99_ns,
					  from->max_ns};
}

static int decode_latencies(void *arena, const Stage__V1__Statistics *from,
			    struct stage_statistics *to)
{
	struct stage_latency *latencies =
		decode_alloc(arena, from->n_latencies * sizeof(*latencies));

	if (from->n_latencies > LATENCIES_MAX || !latencies)
		return -EPROTO;
	for (size_t s = 0; s < from->n_latencies; s++) {
		const Stage__V1__Latency *one = from->latencies[s];

		if (!decode_text_is_clean(one->stage))
			return -EPROTO;
		latencies[s] = (struct stage_latency){one->stage, decode_percentiles(one->run),
						      decode_percentiles(one->recent)};
	}
	to->latency_count = (uint32_t)from->n_latencies;
	to->latencies = latencies;
	return 0;
}

static int decode_pulses(void *arena, const Stage__V1__Pulses *from, struct stage_statistics *to)
{
	struct stage_pulses *pulses;

	if (!from)
		return 0;
	pulses = decode_alloc(arena, sizeof(*pulses));
	if (!pulses)
		return -EPROTO;
	*pulses = (struct stage_pulses){.lost = from->lost,
					.missed = from->missed,
					.reopened = from->reopened,
					.late = decode_percentiles(from->late)};
	to->pulses = pulses;
	return decode_counts(arena, from->events, from->n_events, &pulses->events,
			     &pulses->event_count);
}

static int decode_stalls(void *arena, const Stage__V1__Statistics *from,
			 struct stage_statistics *to)
{
	struct stage_stall *stalls = decode_alloc(arena, from->n_stalled * sizeof(*stalls));

	if (from->n_stalled > STALLS_MAX || !stalls)
		return -EPROTO;
	for (size_t i = 0; i < from->n_stalled; i++) {
		const Stage__V1__Stall *one = from->stalled[i];

		if (!decode_text_is_clean(one->thread))
			return -EPROTO;
		stalls[i] = (struct stage_stall){one->thread, one->still_ns};
	}
	to->stall_count = (uint32_t)from->n_stalled;
	to->stalls = stalls;
	return 0;
}

static int decode_unnamed(void *arena, const Stage__V1__Unnamed *from, struct stage_statistics *to)
{
	struct stage_unnamed *unnamed;

	if (!from)
		return 0;
	unnamed = decode_alloc(arena, sizeof(*unnamed));
	if (!unnamed || !decode_text_is_clean(from->remedy))
		return -EPROTO;
	*unnamed = (struct stage_unnamed){from->seconds, from->spots, from->points, from->named,
					  from->remedy};
	to->unnamed = unnamed;
	return 0;
}

int decode_statistics(void *arena, const Stage__V1__Statistics *from, struct stage_event *event)
{
	struct stage_statistics *to = decode_alloc(arena, sizeof(*to));

	if (!to || !decode_text_is_clean(from->state))
		return -EPROTO;
	*to = (struct stage_statistics){.time_ns = from->time_ns,
					.state = from->state,
					.run = from->run,
					.shots_solved = from->shots_solved,
					.shots_incomplete = from->shots_incomplete,
					.shots_lost = from->shots_lost,
					.sim_late = from->sim_late,
					.edges_refused = from->edges_refused,
					.shots_per_s = from->shots_per_s,
					.edges = decode_queue(from->edges),
					.sets = decode_queue(from->sets)};
	if (decode_cameras(arena, from, to) < 0 || decode_latencies(arena, from, to) < 0 ||
	    decode_pulses(arena, from->pulses, to) < 0 || decode_stalls(arena, from, to) < 0 ||
	    decode_unnamed(arena, from->unnamed, to) < 0)
		return -EPROTO;
	*event = (struct stage_event){.kind = STAGE_STATISTICS, .statistics = to};
	return 0;
}
