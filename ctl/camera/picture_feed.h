/*
 * Whole shots of a calibrating station's pictures, out of the memory that it shares: the newest
 * that is there, copied. What came and went meanwhile is counted.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "drivers/camera.h"
#include "track/observe.h"

struct picture_feed; /* one thread's */

/* What the station offers. */
struct fed_camera {
	const char *name; /* the feed's */
	bool is_hd;
	int width_px, height_px;
	enum pixel_format format;
};

struct fed_shot {
	uint64_t number;                 /* of those fed, from 0 */
	uint32_t has_mask;               /* cameras whose picture is there */
	struct frame frames[CAMERA_MAX]; /* with this number; the feed's, until the next shot */
};

/* Returns 0 or an exit code, after a message on stderr. The station must be calibrating. */
int picture_feed_open(struct picture_feed **out, const char *socket_dir);
void picture_feed_close(struct picture_feed *feed); /* accepts NULL */

uint32_t picture_feed_camera_count(const struct picture_feed *feed);
struct fed_camera picture_feed_camera(const struct picture_feed *feed, uint32_t camera);

/* The newest shot, as soon as all cameras have it, or without those that are a period late. Returns
 * 0, -ETIMEDOUT, or -ENOMEM. */
int picture_feed_next(struct picture_feed *feed, int64_t timeout_ns, struct fed_shot *shot);

/* Pictures of a camera that were offered and not fed. */
uint64_t picture_feed_skipped(const struct picture_feed *feed, uint32_t camera);
