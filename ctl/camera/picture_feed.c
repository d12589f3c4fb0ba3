/*
 * Looks every few milliseconds: the station waits for nobody, and tells nobody.
 */
#include "ctl/camera/picture_feed.h"

#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/control_client.h"
#include "protocol/pictures.h"

#define LOOK_NS (2 * NS_PER_MS)
#define LATE_MIN_NS (50 * NS_PER_MS)

struct camera_feed {
	struct fed_camera camera;
	int bits;
	uint8_t *copy; /* owned */
	uint64_t first_seq, last_seq, fed_count;
};

struct picture_feed {
	const struct pictures *memory;
	size_t size_bytes;
	uint32_t camera_count;
	int64_t period_ns;
	struct camera_feed cameras[CAMERA_MAX];
	uint64_t shot_count;
	int64_t last_ns;                 /* of the shot fed last */
	int64_t target_ns, target_at_ns; /* the one waited for, since when; 0: none */
};

/* Inside the memory, and of the size that its format has. */
static bool fits(const struct picture_feed *feed, const struct picture_camera *camera,
		 enum pixel_format format)
{
	uint64_t bytes =
		(uint64_t)pixel_row_bytes(format, (int)camera->width_px) * camera->height_px;

	if (camera->width_px < 1 || camera->width_px > 65535 || camera->height_px < 1 ||
	    camera->height_px > 65535 || bytes > camera->size_bytes)
		return false;
	for (int s = 0; s < PICTURES_SLOTS; s++)
		if (camera->size_bytes > feed->size_bytes ||
		    camera->slots[s].offset_bytes > feed->size_bytes - camera->size_bytes)
			return false;
	return true;
}

static int add_camera(struct picture_feed *feed, const struct picture_camera *from)
{
	struct camera_feed *to = &feed->cameras[feed->camera_count++];
	enum pixel_format format;

	if (!memchr(from->name, '\0', sizeof(from->name)) ||
	    !memchr(from->format, '\0', sizeof(from->format)) ||
	    pixel_format_by_name(&format, from->format) || !fits(feed, from, format))
		return -EPROTO;
	to->camera = (struct fed_camera){from->name, from->is_hd != 0, (int)from->width_px,
					 (int)from->height_px, format};
	to->bits = (int)from->bits;
	to->copy = malloc(from->size_bytes);
	return to->copy ? 0 : -ENOMEM;
}

static int map(struct picture_feed *feed, int fd)
{
	struct stat st;

	if (fd < 0 || fstat(fd, &st) < 0 || st.st_size < (off_t)sizeof(struct pictures))
		return -EPROTO;
	feed->size_bytes = (size_t)st.st_size;
	void *memory = mmap(NULL, feed->size_bytes, PROT_READ, MAP_SHARED, fd, 0);
	if (memory == MAP_FAILED)
		return -errno;
	feed->memory = memory;
	if (feed->memory->magic != PICTURES_MAGIC || feed->memory->version != PICTURES_VERSION ||
	    feed->memory->camera_count > CAMERA_MAX || feed->memory->period_ns <= 0)
		return -EPROTO;
	feed->period_ns = feed->memory->period_ns;
	int err = 0;
	for (uint32_t c = 0; c < feed->memory->camera_count && !err; c++)
		err = add_camera(feed, &feed->memory->cameras[c]);
	return err;
}

int picture_feed_open(struct picture_feed **out, const char *socket_dir)
{
	struct picture_feed *feed = calloc(1, sizeof(*feed));
	json_t *reply = NULL;
	int fd = -1;

	if (!feed)
		return EXIT_CODE_INTERNAL;
	int code = control_ask_fd(&reply, &fd, socket_dir, "org.stage.Control.Pictures");
	json_decref(reply);
	int err = code ? 0 : map(feed, fd);
	if (fd >= 0)
		close(fd);
	if (err) {
		fprintf(stderr,
			"stagectl: what the station shares are no pictures (%s): are both "
			"of the same version?\n",
			strerror(-err));
		code = EXIT_CODE_CONNECTION;
	}
	if (code)
		picture_feed_close(feed);
	else
		*out = feed;
	return code;
}

void picture_feed_close(struct picture_feed *feed)
{
	if (!feed)
		return;
	for (uint32_t c = 0; c < feed->camera_count; c++)
		free(feed->cameras[c].copy);
	if (feed->memory)
		munmap((void *)(uintptr_t)feed->memory, feed->size_bytes);
	free(feed);
}

uint32_t picture_feed_camera_count(const struct picture_feed *feed)
{
	return feed->camera_count;
}

struct fed_camera picture_feed_camera(const struct picture_feed *feed, uint32_t camera)
{
	return feed->cameras[camera].camera;
}

uint64_t picture_feed_skipped(const struct picture_feed *feed, uint32_t camera)
{
	const struct camera_feed *k = &feed->cameras[camera];

	return k->fed_count ? k->last_seq - k->first_seq + 1 - k->fed_count : 0;
}

static int64_t apart_ns(int64_t a_ns, int64_t b_ns)
{
	return a_ns > b_ns ? a_ns - b_ns : b_ns - a_ns;
}

/* The camera's slot of the shot at about `time_ns`, or NULL. */
static const struct picture_slot *slot_of(const struct picture_feed *feed, uint32_t camera,
					  int64_t time_ns)
{
	const struct picture_camera *from = &feed->memory->cameras[camera];

	for (int s = 0; s < PICTURES_SLOTS; s++) {
		const struct picture_slot *slot = &from->slots[s];

		if (atomic_load_explicit(&slot->seq, memory_order_acquire) &&
		    apart_ns(atomic_load_explicit(&slot->mid_exposure_ns, memory_order_relaxed),
			     time_ns) < feed->period_ns / 2)
			return slot;
	}
	return NULL;
}

static int64_t newest_ns(const struct picture_feed *feed)
{
	int64_t newest = 0;

	for (uint32_t c = 0; c < feed->camera_count; c++) {
		const struct picture_camera *from = &feed->memory->cameras[c];
		uint64_t seq = atomic_load_explicit(&from->newest_seq, memory_order_acquire);
		int64_t time_ns = atomic_load_explicit(
			&from->slots[seq % PICTURES_SLOTS].mid_exposure_ns, memory_order_relaxed);

		if (seq && time_ns > newest)
			newest = time_ns;
	}
	return newest;
}

static bool is_whole(const struct picture_feed *feed, int64_t time_ns)
{
	for (uint32_t c = 0; c < feed->camera_count; c++)
		if (!slot_of(feed, c, time_ns))
			return false;
	return true;
}

/* The shot to feed now; 0: not yet. */
static int64_t choose(struct picture_feed *feed)
{
	int64_t newest = newest_ns(feed), now_ns = clock_real_now_ns();
	int64_t late_ns = feed->period_ns > LATE_MIN_NS ? feed->period_ns : LATE_MIN_NS;

	if (newest <= feed->last_ns + feed->period_ns / 2)
		return 0;
	if (is_whole(feed, newest))
		return newest;
	if (!feed->target_ns || feed->target_ns <= feed->last_ns) {
		feed->target_ns = newest;
		feed->target_at_ns = now_ns;
	}
	return is_whole(feed, feed->target_ns) || now_ns - feed->target_at_ns > late_ns
		       ? feed->target_ns
		       : 0;
}

/* False when it was overwritten meanwhile: then it counts as one that was not fed. */
static bool copy(struct picture_feed *feed, uint32_t c, int64_t time_ns, struct fed_shot *shot)
{
	const struct picture_slot *slot = slot_of(feed, c, time_ns);
	struct camera_feed *to = &feed->cameras[c];

	if (!slot)
		return false;
	uint64_t seq = atomic_load_explicit(&slot->seq, memory_order_acquire);
	int64_t mid_ns = atomic_load_explicit(&slot->mid_exposure_ns, memory_order_relaxed);
	uint64_t size_bytes = atomic_load_explicit(&slot->jpeg_bytes, memory_order_relaxed);
	memcpy(to->copy, (const uint8_t *)feed->memory + slot->offset_bytes,
	       feed->memory->cameras[c].size_bytes);
	atomic_thread_fence(memory_order_acquire);
	if (!seq || atomic_load_explicit(&slot->seq, memory_order_relaxed) != seq ||
	    size_bytes > feed->memory->cameras[c].size_bytes)
		return false;
	if (!to->fed_count)
		to->first_seq = seq;
	to->last_seq = seq;
	to->fed_count++;
	shot->frames[c] = (struct frame){
		.pixels = to->copy,
		.width_px = to->camera.width_px,
		.height_px = to->camera.height_px,
		.stride_bytes = (int)pixel_row_bytes(to->camera.format, to->camera.width_px),
		.format = to->camera.format,
		.bits = to->bits,
		.size_bytes = size_bytes,
		.shot = feed->shot_count,
		.mid_exposure_ns = mid_ns};
	return true;
}

int picture_feed_next(struct picture_feed *feed, int64_t timeout_ns, struct fed_shot *shot)
{
	const struct timespec nap = {.tv_nsec = LOOK_NS};
	int64_t until_ns = clock_real_now_ns() + timeout_ns, time_ns;

	while (!(time_ns = choose(feed))) {
		if (clock_real_now_ns() > until_ns)
			return -ETIMEDOUT;
		nanosleep(&nap, NULL);
	}
	shot->has_mask = 0;
	for (uint32_t c = 0; c < feed->camera_count; c++)
		shot->has_mask |= (uint32_t)copy(feed, c, time_ns, shot) << c;
	shot->number = feed->shot_count++;
	feed->last_ns = time_ns;
	return 0;
}
