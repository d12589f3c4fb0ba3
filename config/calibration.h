/*
 * How the station is calibrated: the board, and what a new rig must be worth. The config's section
 * `calibration`; a board may have a file of its own, with the same keys as the section's `board`.
 */
#pragma once

#include <stdbool.h>
#include <stdio.h>

#include "base/diag.h"
#include "config/board.h"

struct yaml;
struct yaml_value;

/* A rig with a figure above its limit does not come into force. */
struct calibration_limits {
	double rms_px;         /* of each camera */
	double held_out_px;    /* of views that the rig was not made from */
	double uncertainty_mm; /* one sigma, rms over the volume */
	double worst_mm;       /* one sigma, at its worst place */
};

struct calibration {
	bool has_board;
	struct board board;
	struct calibration_limits limits;
	double blur_max_px; /* a view with more is refused */
	int poses_max;      /* chosen of those that were seen */
	int poses_min;      /* before it is enough, however well they fill the images */
	/* the light, live */
	double rate_hz;
	int64_t exposure_ns;    /* of the IR cameras */
	int64_t hd_exposure_ns; /* 0: as in the station's own plan */
};

struct calibration calibration_default(void);

/* The config's section; `calibration` has defaults before. */
void calibration_read(struct yaml *yaml, const struct yaml_value *value,
		      struct calibration *calibration);

/* A board's own file. Returns 0, -EINVAL with "file:line:column: ..." or the errno of reading. */
int board_load(struct board *board, const char *path, struct diag *diag);
void board_print(FILE *file, const struct board *board);
