/*
 * The board in the picture of one camera, IR or HD.
 */
#pragma once

#include "sim/board/board_view.h"
#include "sim/render/sensor.h"
#include "sim/world/scene.h"

/* What paper that faces the camera at its usual range comes to, for the four pixels of a Bayer
 * cell, row by row; all alike for a grey camera. */
struct board_paper {
	float grey[2][2];
	bool covers; /* hides what the image shows; else its light comes to the noise's background
		      */
};

struct board_picture;

/* `camera` counts from the scene's first IR camera. Returns 0 or -ENOMEM; the scene is borrowed. */
int board_picture_create(struct board_picture **out, const struct sim_scene *scene, uint32_t camera,
			 double blur_sigma_px, const struct board_paper *paper);
void board_picture_destroy(struct board_picture *picture); /* accepts NULL */

/* Draws the board as of shot `shot` over the image, with its noise, and says where. Does not
 * allocate. */
struct pixel_window board_picture_draw(struct board_picture *picture, uint64_t shot,
				       const struct sensor *sensor, struct rng *rng,
				       uint8_t *image);
