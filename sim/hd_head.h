/*
 * A head for HD pictures: the skull's ellipsoid with a painted face, shaded, drawn into a Bayer
 * mosaic. Cheap rather than true: only the markers, drawn over it, are measured by anybody.
 */
#pragma once

#include <stdint.h>

#include "sim/scene_parts.h"
#include "sim/spot.h"

#define HD_HEAD_SIDE 256 /* texels each way */

enum hd_colour { HD_RED, HD_GREEN, HD_BLUE, HD_COLOURS };

/* The unit sphere that the ellipsoid is a stretched one of, seen along the head's z axis: once
 * from in front, once from behind. Flat; read by any thread once made. */
struct hd_head {
	uint8_t texels[2][HD_HEAD_SIDE][HD_HEAD_SIDE][4]; /* red, green, blue, nothing */
};

void hd_head_init(struct hd_head *head);

/* How a camera sees the ellipsoid now, to first order around its middle. */
struct hd_sight {
	double middle_px[2];
	double from_px[3][2];    /* unit sphere = from_px * (pixel - middle) + ... */
	double towards[3];       /* ... + towards * sqrt(1 - |the former|^2) */
	struct pixel_window box; /* even on all sides, so that it starts with a red pixel */
};

/* False when the head is out of sight. */
bool hd_sight_find(struct hd_sight *sight, const struct sim_scene *scene, uint32_t camera,
		   const struct pose *rt_stage_head);

/* Draws it over `image`. `grain` are HD_GRAIN values of noise, taken from any place on. */
#define HD_GRAIN 8192 /* a power of two */
void hd_head_draw(const struct hd_head *head, const struct hd_sight *sight, const int8_t *grain,
		  uint32_t grain_start, uint8_t *image, int width_px);
