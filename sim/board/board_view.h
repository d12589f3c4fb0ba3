/*
 * What of the board falls on each pixel of a camera, row by row.
 */
#pragma once

#include "sim/board/board.h"
#include "sim/board/board_art.h"
#include "sim/render/spot.h"

#define BOARD_NODE_STEP_PX 2
#define BOARD_NODE_MAX (2048 / BOARD_NODE_STEP_PX + 2)

/* A pixel and the place on the board that it looks at. */
struct board_node {
	float xy_m[2];
	float smear_m[2]; /* how far that place moves during the exposure */
	float gain;       /* brightness there */
};

struct board_view {
	const struct sim_board *board;   /* borrowed */
	const struct board_art *art;     /* borrowed */
	const struct sim_camera *camera; /* borrowed */
	double lens_blur_px;             /* a sigma */
	double range_m;                  /* where `gain` is 1 */
	struct exposure exposure;        /* of the picture */
	float blur_px;                   /* of lens, focus and pixel */
	struct pixel_window box;         /* all that the board covers; empty when out of sight */
	int node_row;                    /* y of nodes[0], in BOARD_NODE_STEP_PX from the box's */
	struct board_node nodes[2][BOARD_NODE_MAX]; /* above and below the row drawn last */
	double guess_xy_m[2];                       /* the first node of the newest row */
};

/* `blur_sigma_px` is the lens's; the pixel's own is added. */
void board_view_init(struct board_view *view, const struct sim_board *board,
		     const struct board_art *art, const struct sim_camera *camera,
		     double blur_sigma_px, double range_m);

/* A new picture: finds the box. */
void board_view_begin(struct board_view *view, const struct exposure *exposure);

/* Row y of the box; rows come in order. `light`: brightness of the board (1: paper that faces the
 * camera at range_m); `cover`: how much of the pixel it hides. Both of the box's width. */
void board_view_row(struct board_view *view, int y, float *light, float *cover);
