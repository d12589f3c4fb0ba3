/*
 * The sensor's picture: background noise with windows of light exposed over it.
 */
#pragma once

#include <stdint.h>

#include "base/rng.h"
#include "sim/noise.h"
#include "sim/spot.h"
#include "track/observe.h"

#define CANVAS_WINDOWS (LABEL_MAX + 16)

struct canvas {
	/* set when made */
	int width_px, height_px;
	struct noise *noise;  /* owned */
	uint32_t frame_count; /* of pre-made noise in the strip; 1 = fresh noise every time */
	uint8_t *strip;       /* owned */
	float *light;         /* owned; of all windows, one behind the other */
	uint8_t *before;      /* owned; what the windows covered, in the same places */
	/* owned by the thread that draws */
	uint8_t *image; /* within the strip */
	uint32_t window_count, light_count;
	struct {
		struct pixel_window at;
		uint32_t first; /* in light and before */
	} windows[CANVAS_WINDOWS];
};

/* Returns 0 or -ENOMEM; then nothing is held. All memory has been touched. */
int canvas_init(struct canvas *canvas, int width_px, int height_px, uint32_t frame_count,
		double background_grey, struct rng *rng);
void canvas_finish(struct canvas *canvas); /* a zeroed canvas is fine */

/* A new exposure: no windows, another background. None of these allocates. */
void canvas_clear(struct canvas *canvas, struct rng *rng);

/* Where the window's light goes, row by row; NULL when it is empty or there is no place left. */
float *canvas_add_window(struct canvas *canvas, struct pixel_window window);

/* The picture, valid until the next canvas_clear(). Light of overlapping windows adds up. */
const uint8_t *canvas_expose(struct canvas *canvas, struct rng *rng);
