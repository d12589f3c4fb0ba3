/*
 * The board's print as a camera's blur shows it: every edge of squares and tags integrated with a
 * Gaussian, no sampling, so that no edge moves by a fraction of a pixel.
 */
#pragma once

#include "config/board_pattern.h"
#include "sim/board/board.h"

#define BOARD_ART_TABLE 1024

/* Flat; read by any thread once made. */
struct board_art {
	struct board_pattern pattern;
	float low_m[2], high_m[2];             /* the plate, its margin included; board frame */
	float cumulative[BOARD_ART_TABLE + 1]; /* of the standard normal, -4 to 4 */
};

/* Returns 0 or -ENOMEM. */
int board_art_init(struct board_art *art, const struct sim_board *board);

/* The ink (0 to 1) at a place of the board that is blurred by sigma_m in x and y, and how much of
 * the blurred place is board at all. */
float board_art_ink(const struct board_art *art, const float xy_m[2], const float sigma_m[2],
		    float *board_share);
