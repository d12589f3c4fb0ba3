/*
 * Lamps that a camera looks into: other IR cameras' strobes, which saturate it, and the HD cameras'
 * ring lights, of which its filter lets a little through.
 */
#pragma once

#include "sim/render/spot.h"
#include "sim/world/scene_parts.h"

#define LAMP_RING_LEDS 12
#define LAMP_MAX (SIM_CAMERA_MAX + SIM_HD_MAX * LAMP_RING_LEDS)

/* Finds the lamps that shine into camera `camera` as it stands at that time; the strobes among them
 * only when they are lit. Returns how many. */
uint32_t lamps_find(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t camera,
		    bool strobes_lit, struct spot out[LAMP_MAX]);
