/*
 * Shared by the files of the fake V4L2 cameras only.
 */
#pragma once

#include <linux/videodev2.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#define FAKES_MAX 16
#define BUFFERS_MAX 32
#define NS_PER_S INT64_C(1000000000)

enum buffer_state { FREE, QUEUED, DONE };

struct fake_buffer {
	enum buffer_state state;
	struct v4l2_buffer about;
};

/* One open file. The settings are read when it is opened. */
struct fake {
	int fd; /* eventfd: one count per picture that is done; 0 = this entry is not in use */
	char path[512];
	/* settings */
	char card[64], driver[64], formats[64], stamps[64], jpeg[256];
	long width, height, stride, period_us, exposure_us, readout_us;
	long error_every, gap_every, short_every; /* of the pictures every Nth */
	long eio_after;                           /* so many pictures, for ever */
	long quiet; /* after the plug is pulled DQBUF says "nothing yet", QBUF that it is gone */
	long still; /* the sequence stands still */
	long cannot_stream, metadata, denied, busy;
	long planes;             /* of its pictures, by the API for several; 0: the other one */
	long hblank, pixel_rate; /* of its sensor; 0: not told */
	long offset;             /* of pictures in their plane */
	/* mode and memory */
	long full_width, full_height; /* those of the settings; half of both is offered too */
	uint32_t fourcc, size_bytes, buffer_count;
	int memory_fd;
	uint8_t *memory;
	struct fake_buffer buffers[BUFFERS_MAX];
	uint32_t fifo[BUFFERS_MAX], fifo_count; /* queued, oldest first */
	uint32_t done[BUFFERS_MAX], done_count;
	uint32_t sequence;
	bool streams;
	int64_t begin_ns;
	pthread_t thread;
	bool has_thread;
	atomic_bool ending, gone;
};

extern struct fake fakes[FAKES_MAX];

/* No mutex: the callers may be real-time threads, which the guard of tests/rt watches. */
void fake_lock(void);
void fake_unlock(void);

/* The answer to an ioctl, as the kernel gives it; locked. */
int fake_answer(struct fake *fake, unsigned long request, void *argument);

/* The settings of fake->path; false when it cannot be read. */
bool fake_read_settings(struct fake *fake);
void fake_set_format(struct fake *fake, uint32_t fourcc);
const char *fake_nth_format(const struct fake *fake, uint32_t index); /* NULL: no more */
uint32_t fake_fourcc(const char *text);
int fake_pixel_bytes(uint32_t fourcc);

/* The camera's thread, from STREAMON to STREAMOFF. */
int fake_start(struct fake *fake);
void fake_stop(struct fake *fake); /* not locked */
