/*
 * Heads, necks, bodies and hands in HD pictures: ellipsoids, drawn in perspective into a Bayer
 * mosaic, all four pixels of a cell alike. Only the markers, drawn over them, are measured by
 * anybody.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "sim/cameras.h"
#include "sim/render/hd_paint.h"
#include "sim/render/spot.h"
#include "sim/world/scene.h"

/* How a camera sees an ellipsoid: rays in the coordinates of its unit sphere, exact in the plane
 * that faces the camera through its middle. */
struct hd_sight {
	double middle_px[2];
	double camera[3];         /* where it stands; -camera leads to the middle */
	double right[3], down[3]; /* of the ray, per pixel */
	struct pixel_window box;  /* even on all sides, so that it starts with a red pixel */
};

/* False when it is out of sight. */
bool hd_sight_find(struct hd_sight *sight, const struct sim_camera *camera,
		   const struct sim_truth_occluder *solid);

struct hd_coat {
	const struct hd_paint *paint; /* NULL: of one colour */
	struct hd_mood mood;
	uint8_t colour[HD_COLOURS];
	float light[3]; /* where it comes from; unit sphere */
};

/* Noise, taken from any place on. */
#define HD_GRAIN \
	8192 /* a power of two; HD_GRAIN_MORE follow, for a piece that starts at the last */
#define HD_GRAIN_MORE 1024

struct hd_canvas {
	uint8_t *image;
	int width_px;
	const int8_t *grain;
	uint32_t grain_at;
};

/* Draws the rows [y0, y1), both even, of the solid. Returns what it covered. */
struct pixel_window hd_solid_draw(const struct hd_sight *sight, const struct hd_coat *coat, int y0,
				  int y1, struct hd_canvas *canvas);
