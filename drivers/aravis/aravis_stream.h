/*
 * Shared by the files of the aravis driver only: one camera and its stream. Aravis' own thread
 * receives a frame into one of our buffers; its callback hands the buffer to the capture thread
 * through a ring and a semaphore, and takes released ones back through another.
 */
#pragma once

#include <semaphore.h>
#include <stdatomic.h>

#include "base/ring.h"
#include "drivers/aravis/aravis_device.h"
#include "drivers/aravis/aravis_ptp.h"
#include "drivers/aravis/aravis_watch.h"
#include "drivers/clock_map.h"
#include "drivers/frame_counter.h"

#define ARAVIS_POOL_MAX 64

/* One frame's memory. Owned by whoever holds the buffer. */
struct aravis_slot {
	ArvBuffer *buffer; /* one reference is ours, one travels */
	int64_t leader_ns; /* when the frame's first packet was in memory */
	int64_t arrival_ns;
	bool held; /* by us, not by Aravis */
};

/* Of the middle row's exposure behind that of the first. */
struct aravis_rows {
	int64_t middle_ns, bound_ns;
};

struct aravis_camera {
	struct camera base;

	/* set before the stream starts */
	char address[128];
	ArvCamera *device;
	struct camera_mode mode;
	enum camera_receive wanted_receive;
	struct aravis_rows rows;
	ArvPixelFormat format;
	bool stamps_middle;
	bool resends;
	struct aravis_ptp ptp;
	ArvStream *stream;
	uint8_t *memory; /* of all slots, owned */
	uint32_t slot_count;
	struct aravis_slot slots[ARAVIS_POOL_MAX];
	struct aravis_watch watch;

	/* between the threads; items are struct aravis_slot * */
	struct ring arrived;  /* receive thread to capture thread */
	struct ring released; /* capture thread to receive thread */
	sem_t ready;          /* arrived frames, and one post when the device is gone */
	atomic_bool gone;
	atomic_bool stopping; /* the receive thread leaves buffers to Aravis */

	/* owned by the receive thread: first packets of frames under way, which end in order */
	int64_t leaders_ns[ARAVIS_POOL_MAX];
	_Atomic uint32_t started_count; /* the watch reads it */
	uint32_t done_count;

	/* owned by the capture thread */
	struct frame_counter counter;
	struct clock_map clock;
	int64_t last_ns; /* middle of the exposure of the first row, of the last frame */
};

/* As in camera_driver. */
int aravis_counts(const struct camera *base, struct camera_count out[CAMERA_COUNT_MAX]);
int aravis_facts(const struct camera *base, struct camera_fact out[CAMERA_FACT_MAX]);

/* Makes the buffers and the stream into them; the device does not send yet. Returns 0 or a negative
 * errno; -EIO has a message. After a failure too it is to be closed. Control thread. */
int aravis_stream_open(struct aravis_camera *camera, size_t payload_bytes, struct diag *diag);

/* Asks the camera to stop sending: for seconds, when it is gone. Accepts what is not open. */
void aravis_stream_close(struct aravis_camera *camera);
