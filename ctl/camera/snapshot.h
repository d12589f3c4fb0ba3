/*
 * One image of a camera and the spots in it, from a camera opened by its address or from the
 * running station by the camera's name. Both end in the same JSON object, that of
 * org.stage.Control.Preview and of its status.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "drivers/camera.h"
#include "track/observe.h"

struct snapshot {
	char camera[256]; /* name or address */
	int width_px, height_px;
	enum pixel_format format; /* grey, RGB or the usual Bayer: picture_plain.h */
	int64_t mid_exposure_ns;
	uint8_t *pixels; /* rows without padding; owned */
	uint32_t blob_count;
	struct blob blobs[BLOB_MAX];
};

/* An address has a colon, a name has not. Both return 0 or an exit code after a message on stderr.
 */
bool snapshot_is_address(const char *camera);
int snapshot_from_address(struct snapshot *out, const char *address);
int snapshot_from_station(struct snapshot *out, const char *socket_dir, const char *name);
/* Copies a frame and finds the spots of a grey one. Returns 0 or a negative errno. */
int snapshot_from_frame(struct snapshot *out, const char *camera, const struct frame *frame);
/* The device's own choice: grey, or if it has none colour. */
int snapshot_configure(const struct camera_driver *driver, struct camera *camera,
		       struct camera_mode *granted, struct diag *diag);
void snapshot_finish(struct snapshot *snapshot); /* a zeroed one is fine */

/* Writes a PNG in which every blob is circled. Returns 0 or a negative errno. */
int snapshot_write_png(const struct snapshot *snapshot, const char *path);
