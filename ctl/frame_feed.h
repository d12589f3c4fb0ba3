/*
 * Image after image of one grey camera: from a camera opened by its address, or from the running
 * station by the camera's name.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

struct fed_image {
	const uint8_t *pixels; /* until the call returns */
	int width_px, height_px, stride_bytes;
};

/* Gets one image; false: enough. */
typedef bool frame_feed_fn(const struct fed_image *image, void *user);

/* Feeds until `take` has enough, a recording ends, or nothing comes. Returns 0 or an exit code,
 * after a message on stderr. */
int frame_feed(const char *camera, const char *socket_dir, frame_feed_fn *take, void *user);
