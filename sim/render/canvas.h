/*
 * The sensor's picture: background noise with windows of light exposed over it.
 */
#pragma once

#include <stdint.h>

#include "base/rng.h"
#include "sim/face/script.h"
#include "sim/render/sensor.h"
#include "sim/render/spot.h"
#include "track/observe.h"

#define CANVAS_WINDOWS (LABEL_MAX + 256)
#define CANVAS_LIGHT_MAX (512 * 1024) /* pixels of all windows */

struct canvas_plan {
	int width_px, height_px;
	uint32_t frame_count; /* of pre-made noise; 1 = fresh noise every time */
	int optics;           /* enum sim_optics: which sensor's noise */
	double black_grey, ambient_grey;
};

struct canvas {
	/* set when made */
	int width_px, height_px;
	struct sensor sensor; /* owned; patterned noise keeps its place: its strip is of frames */
	uint32_t frame_count;
	uint8_t *strip;  /* owned; of the pre-made noise */
	int16_t *rows;   /* owned; of each frame, with patterned noise */
	float *light;    /* owned; of all windows, one behind the other */
	uint8_t *before; /* owned; what the windows covered, in the same places */
	/* owned by the thread that draws */
	uint8_t *image; /* within the strip */
	uint32_t window_count, light_count;
	struct {
		struct pixel_window at;
		uint32_t first; /* in light and before */
	} windows[CANVAS_WINDOWS];
};

/* Returns 0 or -ENOMEM; then nothing is held. All memory has been touched. */
int canvas_init(struct canvas *canvas, const struct canvas_plan *plan, struct rng *rng);
void canvas_finish(struct canvas *canvas); /* a zeroed canvas is fine */

/* A new exposure: no windows, another background. None of these allocates. */
void canvas_clear(struct canvas *canvas, struct rng *rng);

/* Where the window's light goes, row by row; NULL when it is empty or there is no place left. */
float *canvas_add_window(struct canvas *canvas, struct pixel_window window);

/* The picture, valid until the next canvas_clear(). Light of overlapping windows adds up. */
const uint8_t *canvas_expose(struct canvas *canvas, struct rng *rng);
