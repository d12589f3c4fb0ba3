/*
 * A fake camera's pictures and their times.
 */
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include "tests/contract/fake_v4l2.h"
#include "tests/contract/fake_v4l2_parts.h"

#define TICK_NS INT64_C(2000000) /* how soon a pulled plug is seen */

static int64_t now_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return now.tv_sec * NS_PER_S + now.tv_nsec;
}

static void sleep_until(int64_t at_ns)
{
	struct timespec at = {.tv_sec = at_ns / NS_PER_S, .tv_nsec = at_ns % NS_PER_S};

	clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
}

static int top_bits(uint32_t fourcc)
{
	return fourcc == V4L2_PIX_FMT_Y16   ? 8
	       : fourcc == V4L2_PIX_FMT_Y12 ? 4
	       : fourcc == V4L2_PIX_FMT_Y10 ? 2
					    : 0;
}

static void put_grey(const struct fake *fake, uint8_t *row, long x, unsigned int grey)
{
	uint16_t word = (uint16_t)(grey << top_bits(fake->fourcc));

	if (fake->fourcc == V4L2_PIX_FMT_YUYV)
		row[2 * x] = (uint8_t)grey, row[2 * x + 1] = 128;
	else if (fake_pixel_bytes(fake->fourcc) == 2)
		memcpy(row + 2 * x, &word, 2);
	else
		row[x] = (uint8_t)grey;
}

/* Dark, with a square of FAKE_V4L2_SPOT_PX that moves on by a pixel a picture. */
static void draw(const struct fake *fake, uint8_t *pixels)
{
	long left = FAKE_V4L2_SPOT_PX + (long)fake->sequence % (fake->width / 2);
	long top = fake->height / 2;

	for (long y = 0; y < fake->height; y++)
		for (long x = 0; x < fake->width; x++)
			put_grey(fake, pixels + y * fake->stride, x,
				 x >= left && x < left + FAKE_V4L2_SPOT_PX && y >= top &&
						 y < top + FAKE_V4L2_SPOT_PX
					 ? 200
					 : 12);
}

static void write_truth(const struct fake *fake, uint8_t *pixels, int64_t mid_exposure_ns)
{
	int step = fake->fourcc == V4L2_PIX_FMT_YUYV ? 2 : 1;
	uint8_t truth[8];

	memcpy(truth, &mid_exposure_ns, sizeof(truth));
	for (int i = 0; i < 8; i++)
		pixels[i * step] = truth[i];
}

/* Returns bytesused. */
static uint32_t fill(const struct fake *fake, uint8_t *pixels, int64_t mid_exposure_ns)
{
	if (fake->fourcc != V4L2_PIX_FMT_MJPEG) {
		draw(fake, pixels);
		write_truth(fake, pixels, mid_exposure_ns);
		return (uint32_t)(fake->stride * fake->height);
	}
	FILE *file = *fake->jpeg ? fopen(fake->jpeg, "rb") : NULL;
	size_t length = file ? fread(pixels, 1, fake->size_bytes, file) : 0;

	if (file)
		fclose(file);
	if (!length) {
		memcpy(pixels, "\xff\xd8", 2);
		memset(pixels + 2, (int)(fake->sequence & 0x7f), 500);
		length = 502 + fake->sequence % 100;
	}
	return (uint32_t)length;
}

static bool every(long nth, uint32_t sequence)
{
	return nth > 0 && sequence % (uint32_t)nth == (uint32_t)nth - 1;
}

static void stamp(const struct fake *fake, struct v4l2_buffer *about, int64_t start_ns,
		  int64_t end_ns)
{
	int64_t at_ns = 0;

	about->flags = V4L2_BUF_FLAG_MAPPED | V4L2_BUF_FLAG_DONE;
	if (strcmp(fake->stamps, "soe") == 0) {
		about->flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
		at_ns = start_ns;
	} else if (strcmp(fake->stamps, "eof") == 0) {
		about->flags |= V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
		at_ns = end_ns;
	} else if (strcmp(fake->stamps, "copy") == 0) {
		about->flags |= V4L2_BUF_FLAG_TIMESTAMP_COPY;
		at_ns = 42;
	}
	about->timestamp.tv_sec = at_ns / NS_PER_S;
	about->timestamp.tv_usec = at_ns % NS_PER_S / 1000;
}

/* The buffer that has waited longest; -1 when there is none. */
static int take_queued(struct fake *fake)
{
	int index = -1;

	fake_lock();
	if (fake->fifo_count) {
		index = (int)fake->fifo[0];
		memmove(fake->fifo, fake->fifo + 1, --fake->fifo_count * sizeof(fake->fifo[0]));
	}
	fake_unlock();
	return index;
}

/* Not locked: the buffer is nobody else's until it is done. */
static void fill_buffer(struct fake *fake, uint32_t index, int64_t start_ns, int64_t end_ns)
{
	struct v4l2_buffer *about = &fake->buffers[index].about;
	uint8_t *pixels = fake->memory + (size_t)index * fake->size_bytes + fake->offset;

	about->bytesused = fill(fake, pixels, start_ns + fake->exposure_us * 1000 / 2);
	stamp(fake, about, start_ns, end_ns);
	about->sequence = fake->still ? 0 : fake->sequence;
	if (every(fake->error_every, fake->sequence))
		about->flags |= V4L2_BUF_FLAG_ERROR;
	if (every(fake->short_every, fake->sequence))
		about->bytesused = fake->size_bytes / 2;
	about->bytesused += (uint32_t)fake->offset;
}

/* The picture whose exposure began at start_ns is ready. */
static void finish_picture(struct fake *fake, int64_t start_ns, int64_t end_ns)
{
	int index = take_queued(fake);

	if (index >= 0) {
		fill_buffer(fake, (uint32_t)index, start_ns, end_ns);
		fake_lock();
		fake->buffers[index].state = DONE;
		fake->done[fake->done_count++] = (uint32_t)index;
		fake_unlock();
		eventfd_write(fake->fd, 1);
	}
	fake->sequence++; /* without a buffer it is lost, and counted */
	if (every(fake->gap_every, fake->sequence))
		fake->sequence++;
}

static void *play(void *argument)
{
	struct fake *fake = argument;
	int64_t period_ns = fake->period_us * 1000;

	for (int64_t k = 0; !fake->ending && !fake->gone; k++) {
		int64_t start_ns = fake->begin_ns + k * period_ns;
		int64_t end_ns = start_ns + (fake->exposure_us + fake->readout_us) * 1000;

		while (now_ns() < end_ns && !fake->ending && !fake->gone) {
			fake->gone = access(fake->path, F_OK) != 0;
			sleep_until(end_ns < now_ns() + TICK_NS ? end_ns : now_ns() + TICK_NS);
		}
		if (!fake->gone && !fake->ending)
			finish_picture(fake, start_ns, end_ns);
	}
	if (fake->gone)
		eventfd_write(fake->fd, 1);
	return NULL;
}

int fake_start(struct fake *fake)
{
	fake->sequence = 0;
	fake->begin_ns = now_ns();
	fake->has_thread = pthread_create(&fake->thread, NULL, play, fake) == 0;
	return fake->has_thread ? 0 : -1;
}

void fake_stop(struct fake *fake)
{
	if (!fake->has_thread)
		return;
	fake->ending = true;
	pthread_join(fake->thread, NULL);
	fake->has_thread = false;
	fake->ending = false;
}
