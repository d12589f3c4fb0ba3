/*
 * The board in the pictures of a recording, IR and HD: a thread per camera reads and searches, as
 * many at once as there are processors.
 */
#pragma once

#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>

#include "calib/board/observations.h"
#include "config/config.h"
#include "ctl/calibrate/calibrate_search.h"

struct picture_progress {
	_Atomic uint32_t done, with_board;
	uint32_t of;
};

/* Called on the caller's thread every now and then, and at the end. */
typedef void picture_progress_fn(const struct picture_progress *progress, void *user);

/* Reads all files: cameras of the config. `stop` ends it early, with what was found so far.
 * Returns 0 or a negative errno with messages; then nothing is held. */
int calibrate_read(struct observations *observations, struct picture_counts *counts,
		   const struct config *config, const struct board *board,
		   const volatile sig_atomic_t *stop, picture_progress_fn *progress, void *user,
		   struct diag *diag);
