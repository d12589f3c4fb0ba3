/*
 * Pictures of a scene as its HD cameras take them: 8-bit Bayer, RGGB; a shaded head that follows
 * the actor's, and the markers as bright spots in the light of the lens's ring. One renderer per
 * camera and thread.
 */
#pragma once

#include <stdint.h>

#include "sim/world/scene.h"

struct sim_hd_renderer;

/* `camera` counts from the scene's first IR camera. Returns 0 or -ENOMEM. The scene is borrowed. */
int sim_hd_renderer_create(struct sim_hd_renderer **out, const struct sim_scene *scene,
			   uint32_t camera);
void sim_hd_renderer_destroy(struct sim_hd_renderer *renderer); /* accepts NULL */

/* Renders shot `shot` as of its HD mid-exposure: the same scene, seed, camera and shot give the
 * same pixels. The image (stride = width) is the renderer's until the next call. Does not allocate.
 */
const uint8_t *sim_hd_render(struct sim_hd_renderer *renderer, uint64_t shot, int *width_px,
			     int *height_px);
