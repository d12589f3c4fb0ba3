/*
 * Everybody in front of an HD camera, the nearest drawn last: heads with their faces, necks,
 * bodies, hands, passers-by. What hides markers hides skin too.
 */
#pragma once

#include "sim/render/hd_solid.h"
#include "sim/sights.h"
#include "sim/world/scene.h"

#define HD_FIGURE_MAX (SIM_OCCLUDER_MAX + SIM_ACTOR_MAX)

struct hd_figures;

/* Returns 0 or -ENOMEM. The scene is borrowed. destroy accepts NULL. */
int hd_figures_create(struct hd_figures **out, const struct sim_scene *scene);
void hd_figures_destroy(struct hd_figures *figures);

/* Draws all of them at their rows' times; what they covered goes to `covered`. Returns how many
 * windows that are. Does not allocate. */
uint32_t hd_figures_draw(struct hd_figures *figures, const struct sim_rolling *rolling,
			 const struct sim_camera *camera, struct hd_canvas *canvas,
			 struct pixel_window covered[HD_FIGURE_MAX]);
