/*
 * The stream of samples to an adapter: a thread of its own keeps a quarter of a second of them on
 * their way, so that the lines depend on no scheduler, and tells which shots are in it.
 */
#pragma once

#include <pthread.h>
#include <stdatomic.h>

#include "base/clock.h"
#include "base/ring.h"
#include "drivers/usb/ft232h.h"
#include "drivers/usb/usb_pace.h"

/* A shot whose samples are on their way. */
struct usb_shot {
	uint64_t shot;
	int64_t sample;    /* its first */
	int64_t device_ns; /* of that, by the adapter's clock */
	int64_t due_ns;
	int64_t uncertainty_ns; /* as known then; less once its stream has run for a while */
	uint32_t events;
};

struct usb_stream {
	/* set before the thread starts */
	struct ft232h *adapter; /* borrowed */
	struct usb_wave wave;
	int64_t period_ns;
	struct ft232h_write *writes; /* owned, used in turn */
	uint32_t write_count;
	uint8_t *samples; /* owned; of the shot that is being sent */
	int64_t lead;     /* samples that are to be on their way */
	pthread_t thread;
	bool running;
	/* the thread that streams; the control thread before it starts */
	struct usb_pace pace;
	uint64_t submitted, done; /* writes */
	int64_t end_sample;       /* of all that was submitted */
	uint32_t strange;         /* events before the next shot */
	bool beginning;           /* nothing is refilled yet */
	bool starved;             /* the adapter runs, or ran, out of samples */
	int64_t moved_ns;         /* when something was taken last */
	/* atomic, any thread */
	_Atomic bool stopping;
	_Atomic int lost;             /* errno */
	_Atomic int64_t first_sample; /* of this stream; what is before was of another */
	_Atomic int64_t taken_sample; /* the adapter took all before */
	_Atomic int64_t delay_ns;     /* between the adapter's clock and ours, now */
	_Atomic int64_t uncertainty_ns;

	struct ring shots;            /* of struct usb_shot, to the trigger thread */
	struct clock_semaphore *wake; /* borrowed; something was taken */
};

/* Fills with a plan's wave. Returns 0, or a negative errno: then nothing is to be finished. Control
 * thread, as all below. */
int usb_stream_init(struct usb_stream *stream, struct ft232h *adapter, const struct usb_wave *wave,
		    int64_t period_ns, struct clock_semaphore *wake);
void usb_stream_finish(struct usb_stream *stream); /* stops it; a zeroed one is fine */

/* Begins with dark samples, then shot 0. */
int usb_stream_start(struct usb_stream *stream);

/* All lines are dark when it returns, and no shot is left. */
void usb_stream_stop(struct usb_stream *stream);
