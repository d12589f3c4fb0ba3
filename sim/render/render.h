/*
 * Pictures of a scene: noise, blur, saturation; one renderer per camera and thread.
 */
#pragma once

#include <stdint.h>

#include "sim/world/scene.h"

struct sim_renderer;

enum sim_noise {
	SIM_NOISE_FULL, /* fresh noise in every pixel */
	SIM_NOISE_FAST, /* pre-made noise frames, fresh noise around the spots: for live use */
};

/* Returns 0 or -ENOMEM. The scene is borrowed. */
int sim_renderer_create(struct sim_renderer **out, const struct sim_scene *scene, uint32_t camera,
			enum sim_noise noise);
void sim_renderer_destroy(struct sim_renderer *renderer); /* accepts NULL */

/* Renders shot `shot`: the same scene, seed, camera and shot give the same pixels. The 8-bit grey
 * image (stride = width) is the renderer's until the next call. Does not allocate. */
const uint8_t *sim_render(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			  int *height_px);

/* The same without its strobe's light: what shines by itself, and noise. */
const uint8_t *sim_render_unlit(struct sim_renderer *renderer, uint64_t shot, int *width_px,
				int *height_px);

/* The same with all strobes dark: lamps that burn by themselves, and noise. */
const uint8_t *sim_render_dark(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			       int *height_px);
