/*
 * The message Statistics. Once a second and for a person to look at: its structs are made on the
 * heap each time.
 */
#include <errno.h>
#include <stdlib.h>

#include "protocol/encode_parts.h"

struct camera_parts {
	Stage__V1__CameraStatistics message;
	Stage__V1__Queue queue;
	Stage__V1__Count losses[STREAM_COUNT_MAX], *loss_pointers[STREAM_COUNT_MAX];
	Stage__V1__Count events[STREAM_COUNT_MAX], *event_pointers[STREAM_COUNT_MAX];
};

struct latency_parts {
	Stage__V1__Latency message;
	Stage__V1__Percentiles run, recent;
};

struct pulses_parts {
	Stage__V1__Pulses message;
	Stage__V1__Percentiles late;
	Stage__V1__Count events[STREAM_COUNT_MAX], *event_pointers[STREAM_COUNT_MAX];
};

/* Message structs of one Statistics, chained to each other. */
struct statistics_parts {
	Stage__V1__Statistics message;
	Stage__V1__Queue edges, sets;
	struct camera_parts cameras[CAMERA_MAX];
	Stage__V1__CameraStatistics *camera_pointers[CAMERA_MAX];
	struct latency_parts latencies[STREAM_LATENCY_MAX];
	Stage__V1__Latency *latency_pointers[STREAM_LATENCY_MAX];
	struct pulses_parts pulses;
	Stage__V1__Stall stalls[STREAM_STALL_MAX], *stall_pointers[STREAM_STALL_MAX];
	Stage__V1__Unnamed unnamed;
};

static Stage__V1__Queue *fill_queue(Stage__V1__Queue *to, const struct stream_queue *from)
{
	stage__v1__queue__init(to);
	to->filled = from->filled;
	to->filled_max = from->filled_max;
	to->capacity = from->capacity;
	return to;
}

/* Returns how many are not 0. */
static size_t fill_counts(Stage__V1__Count *to, Stage__V1__Count **pointers,
			  const struct stream_count *from, uint32_t count)
{
	size_t filled = 0;

	for (uint32_t i = 0; i < count; i++) {
		if (from[i].count == 0)
			continue;
		stage__v1__count__init(&to[filled]);
		to[filled].cause = encode_text(from[i].cause);
		to[filled].count = from[i].count;
		pointers[filled] = &to[filled];
		filled++;
	}
	return filled;
}

static Stage__V1__CameraStatistics *fill_camera(struct camera_parts *parts,
						const struct stream_camera_statistics *from)
{
	Stage__V1__CameraStatistics *to = &parts->message;

	stage__v1__camera_statistics__init(to);
	to->state = encode_text(from->state);
	to->frames = from->frames;
	to->missing = from->missing;
	to->blobs_masked = from->blobs_masked;
	to->reopened = from->reopened;
	to->queue = fill_queue(&parts->queue, &from->queue);
	to->moved_px = from->moved_px;
	to->moved_mrad = from->moved_mrad;
	to->losses = parts->loss_pointers;
	to->n_losses =
		fill_counts(parts->losses, parts->loss_pointers, from->losses, from->loss_count);
	to->events = parts->event_pointers;
	to->n_events =
		fill_counts(parts->events, parts->event_pointers, from->events, from->event_count);
	return to;
}

static Stage__V1__Percentiles *fill_percentiles(Stage__V1__Percentiles *to,
						const struct stream_percentiles *from)
{
	stage__v1__percentiles__init(to);
	to->count = from->count;
	to->p50_ns = from->p50_ns;
	to->p90_ns = from->p90_ns;
	to->p99_ns = from->p99_ns;
	to->max_ns = from->max_ns;
	return to;
}

static Stage__V1__Latency *fill_latency(struct latency_parts *parts,
					const struct stream_latency *from)
{
	stage__v1__latency__init(&parts->message);
	parts->message.stage = encode_text(from->stage);
	parts->message.run = fill_percentiles(&parts->run, &from->run);
	parts->message.recent = fill_percentiles(&parts->recent, &from->recent);
	return &parts->message;
}

static Stage__V1__Pulses *fill_pulses(struct pulses_parts *parts, const struct stream_pulses *from)
{
	Stage__V1__Pulses *to = &parts->message;

	stage__v1__pulses__init(to);
	to->lost = from->lost;
	to->missed = from->missed;
	to->reopened = from->reopened;
	to->late = fill_percentiles(&parts->late, &from->late);
	to->events = parts->event_pointers;
	to->n_events =
		fill_counts(parts->events, parts->event_pointers, from->events, from->event_count);
	return to;
}

static void fill_stalls(struct statistics_parts *parts, const struct stream_statistics *from)
{
	parts->message.n_stalled = from->stall_count;
	parts->message.stalled = parts->stall_pointers;
	for (uint32_t i = 0; i < from->stall_count; i++) {
		stage__v1__stall__init(&parts->stalls[i]);
		parts->stalls[i].thread = encode_text(from->stalls[i].thread);
		parts->stalls[i].still_ns = from->stalls[i].still_ns;
		parts->stall_pointers[i] = &parts->stalls[i];
	}
}

static Stage__V1__Unnamed *fill_unnamed(Stage__V1__Unnamed *to, const struct stream_unnamed *from)
{
	stage__v1__unnamed__init(to);
	to->seconds = from->seconds;
	to->spots = from->spots;
	to->points = from->points;
	to->named = from->named;
	to->remedy = encode_text(from->remedy);
	return to;
}

static void fill_statistics(struct statistics_parts *parts, const struct stream_statistics *from)
{
	Stage__V1__Statistics *to = &parts->message;

	stage__v1__statistics__init(to);
	to->time_ns = from->time_ns;
	to->state = encode_text(from->state);
	to->run = from->run;
	to->shots_solved = from->shots_solved;
	to->shots_incomplete = from->shots_incomplete;
	to->shots_lost = from->shots_lost;
	to->sim_late = from->sim_late;
	to->edges_refused = from->edges_refused;
	to->shots_per_s = from->shots_per_s;
	to->edges = fill_queue(&parts->edges, &from->edges);
	to->sets = fill_queue(&parts->sets, &from->sets);
	to->n_cameras = from->camera_count;
	to->cameras = parts->camera_pointers;
	for (uint32_t c = 0; c < from->camera_count; c++)
		parts->camera_pointers[c] = fill_camera(&parts->cameras[c], &from->cameras[c]);
	to->n_latencies = from->latency_count;
	to->latencies = parts->latency_pointers;
	for (uint32_t s = 0; s < from->latency_count; s++)
		parts->latency_pointers[s] =
			fill_latency(&parts->latencies[s], &from->latencies[s]);
	if (from->has_pulses)
		to->pulses = fill_pulses(&parts->pulses, &from->pulses);
	fill_stalls(parts, from);
	if (from->has_unnamed)
		to->unnamed = fill_unnamed(&parts->unnamed, &from->unnamed);
}

int encode_statistics(const struct stream_statistics *statistics, uint8_t **frame,
		      size_t *size_bytes)
{
	Stage__V1__Message message = STAGE__V1__MESSAGE__INIT;
	struct statistics_parts *parts = malloc(sizeof(*parts));

	if (!parts)
		return -ENOMEM;
	fill_statistics(parts, statistics);
	message.body_case = STAGE__V1__MESSAGE__BODY_STATISTICS;
	message.statistics = &parts->message;
	int r = encode_frame(&message, frame, size_bytes);
	free(parts);
	return r;
}
