/*
 * A camera's lens and sensor as a drawer of spots: one of two unlike models.
 */
#pragma once

#include <stdint.h>

#include "sim/face/script.h"
#include "sim/render/spot.h"
#include "sim/render/spot_tailed.h"

struct optics {
	int kind; /* enum sim_optics */
	int width_px, height_px;
	struct blur blur;
	struct tail_blur *tail; /* owned; of SIM_OPTICS_TAILED alone */
};

/* Of a scene's camera: where its lens's blur lies between the sharpest (0) and the softest (1). */
double optics_share(uint64_t seed, uint32_t camera);

/* Returns 0 or -ENOMEM; then nothing is held. */
int optics_init(struct optics *optics, int kind, double share, int width_px, int height_px);
void optics_finish(struct optics *optics); /* zeroed optics are fine */

/* Standard deviation of the blur, of a Gaussian as wide as the core of the point spread. */
double optics_sigma_px(int kind, double share);

/* The spot's defocus and, in the tailed model, what the lens loses towards the image's corners. */
double optics_defocus_px(int kind, int width_px, int height_px, const struct spot *spot);

/* As spot_window() and spot_fill(). */
struct pixel_window optics_window(const struct optics *optics, const struct spot *spot);
void optics_fill(struct optics *optics, const struct spot *spot, const struct pixel_window *window,
		 float *light);
