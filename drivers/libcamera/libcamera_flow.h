/*
 * The way of a camera's requests between the threads: libcamera's hands finished ones over to the
 * capture thread, and a thread of the driver's own queues the released ones again, because
 * libcamera locks and allocates there. That thread also notices when the sensor is gone.
 */
#pragma once

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "base/ring.h"
#include "drivers/libcamera/libcamera_device.h"

struct libcamera_finished {
	struct libcamera_done done;
	int64_t arrival_ns;
};

struct libcamera_flow {
	/* set before the threads start */
	const struct libcamera_at *at;
	bool streams;
	pthread_t queue_thread;

	/* between the threads */
	struct ring arrived;  /* struct libcamera_finished: libcamera's to the capture thread */
	struct ring released; /* uint32_t buffer: capture thread to the queueing one */
	sem_t ready;          /* arrived ones, and one post when the camera is gone */
	sem_t given;          /* released ones, and one post at the end */
	atomic_bool gone, ending;
	atomic_bool realtime; /* libcamera's thread is: */
	pthread_t completing_thread;
};

/* 0 or -ENOMEM. Control thread, as all but the last two. */
int libcamera_flow_init(struct libcamera_flow *flow, const struct libcamera_at *at);
void libcamera_flow_finish(struct libcamera_flow *flow);

/* 0 or a negative errno. */
int libcamera_flow_start(struct libcamera_flow *flow, const struct libcamera_light *light);
void libcamera_flow_stop(struct libcamera_flow *flow); /* also one that was never started */

/* Capture thread. 0 with the next finished request, -ETIMEDOUT or -ENODEV. */
int libcamera_flow_wait(struct libcamera_flow *flow, int64_t timeout_ns,
			struct libcamera_finished *out);

/* Capture thread: a buffer is the camera's again. */
void libcamera_flow_give(struct libcamera_flow *flow, uint32_t buffer);
