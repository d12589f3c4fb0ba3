/*
 * From the station's structs to messages of stage.proto: the one place that knows both.
 * A frame is what goes over the wire: a uint32 little-endian length, then that many bytes.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "track/layout.h"
#include "track/observe.h"

#define PROTOCOL_VERSION 1
#define FRAME_HEADER_BYTES 4
#define FRAME_TAIL_BYTES 11 /* room that a marker frame leaves for frame_set_sets_lost() */

struct stream_camera {
	char name[NAME_BYTES];
	bool is_hd;
	uint32_t width_px, height_px;
};

/* What a subscriber learns before the first marker set. The pointers are borrowed. */
struct stream_description {
	const char *station_version;
	const char *rig_revision;
	uint32_t rig_serial;
	uint32_t run;
	int64_t period_ns; /* 0 = not known beforehand */
	uint32_t camera_count;
	struct stream_camera cameras[CAMERA_MAX];
	const struct layout *layout;
};

#define STREAM_COUNT_MAX 24  /* causes of losses, or events, of a camera */
#define STREAM_LATENCY_MAX 8 /* stages */
#define STREAM_STALL_MAX (CAMERA_MAX + 2)

/* All texts are borrowed. */
struct stream_count {
	const char *cause;
	uint64_t count;
};

struct stream_queue {
	uint32_t filled, filled_max, capacity;
};

struct stream_camera_statistics {
	const char *state;
	uint64_t frames, missing, blobs_masked, reopened;
	struct stream_queue queue;
	uint32_t loss_count, event_count;
	double moved_px, moved_mrad;
	struct stream_count losses[STREAM_COUNT_MAX], events[STREAM_COUNT_MAX];
};

struct stream_percentiles {
	uint64_t count;
	int64_t p50_ns, p90_ns, p99_ns, max_ns;
};

struct stream_latency {
	const char *stage;
	struct stream_percentiles run, recent;
};

struct stream_pulses {
	bool lost;
	uint64_t missed, reopened;
	struct stream_percentiles late;
	uint32_t event_count;
	struct stream_count events[STREAM_COUNT_MAX];
};

struct stream_stall {
	const char *thread;
	int64_t still_ns;
};

struct stream_unnamed {
	double seconds, spots, points, named;
	const char *remedy;
};

/* How the station does; what the message Statistics says. */
struct stream_statistics {
	int64_t time_ns;
	const char *state;
	uint32_t run;
	double shots_per_s;
	uint64_t shots_solved, shots_incomplete, shots_lost, sim_late, edges_refused;
	struct stream_queue edges, sets;
	uint32_t camera_count, latency_count;
	struct stream_camera_statistics cameras[CAMERA_MAX];
	struct stream_latency latencies[STREAM_LATENCY_MAX];
	bool has_pulses;
	struct stream_pulses pulses;
	uint32_t stall_count;
	struct stream_stall stalls[STREAM_STALL_MAX];
	bool has_unnamed;
	struct stream_unnamed unnamed;
};

enum notice_kind { NOTICE_REFUSED = 1, NOTICE_PROTOCOL = 2 };

/* Message structs and the buffer for one marker set, made once. One thread at a time. */
struct encoder;
int encoder_create(struct encoder **out);      /* 0 or -ENOMEM */
void encoder_destroy(struct encoder *encoder); /* accepts NULL */

/* A marker set as a frame of *size_bytes bytes; the encoder's until the next call, which may also
 * write FRAME_TAIL_BYTES behind it. Does not allocate. */
uint8_t *encode_marker_set(struct encoder *encoder, const struct marker_set *set, int64_t sent_ns,
			   size_t *size_bytes);

/* Puts the subscriber's own loss count into a marker frame of `size_bytes` as encode_marker_set()
 * returned it, in place of any earlier one; returns the frame's new size. */
size_t frame_set_sets_lost(uint8_t *frame, size_t size_bytes, uint64_t sets_lost);

/* As frames that the caller frees. The description's clock is read now. 0 or -ENOMEM. */
int encode_description(const struct stream_description *description, uint8_t **frame,
		       size_t *size_bytes);
int encode_statistics(const struct stream_statistics *statistics, uint8_t **frame,
		      size_t *size_bytes);
int encode_notice(enum notice_kind kind, const char *text, uint8_t **frame, size_t *size_bytes);
