/*
 * The pictures of all cameras while the station calibrates, in memory that other programs may read.
 * Made and freed on the control thread while no capture thread runs.
 */
#pragma once

#include "base/diag.h"
#include "drivers/camera.h"
#include "protocol/pictures.h"

struct pictures_share {
	struct pictures *memory; /* mapped; NULL: there is none */
	size_t size_bytes;
	int fd;
};

struct pictured_camera {
	const char *name;
	bool is_hd;
	struct camera_mode granted;
};

/* All memory is touched. Returns 0 or a negative errno with a message. */
int pictures_share_open(struct pictures_share *share, const struct pictured_camera *cameras,
			uint32_t count, int64_t period_ns, struct diag *diag);

/* Readers keep what they have mapped. A zeroed one is fine. */
void pictures_share_close(struct pictures_share *share);

/* Capture thread: real-time safe. The frame is as granted. */
void pictures_share_put(struct pictures *pictures, uint32_t camera, const struct frame *frame);
