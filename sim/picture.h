/*
 * What a camera hands over of a shot: its rendered picture, or what a fault makes of it. One per
 * camera and thread.
 */
#pragma once

#include <stdint.h>

#include "sim/faults.h"
#include "sim/render/render.h"

struct sim_picture;

/* `camera` counts IR cameras first, then HD ones. Returns 0 or -ENOMEM. The scene is borrowed. */
int sim_picture_create(struct sim_picture **out, const struct sim_scene *scene, uint32_t camera,
		       enum sim_noise noise);
void sim_picture_destroy(struct sim_picture *picture); /* accepts NULL */

/* Of the scene's IR sensors, as `stagectl camera noise` finds it. */
double sim_picture_electrons_per_grey(const struct sim_scene *scene);

/* With or without the light of all IR strobes. Rows of 8 bits without gaps, grey or Bayer; the
 * picture's own until the next call. Does not allocate. */
const uint8_t *sim_picture_take(struct sim_picture *picture, uint64_t shot, sim_fault_mask faults,
				bool strobes_lit, int *width_px, int *height_px);
