/*
 * One message per camera: the first cause that explains all else.
 */
#include "ctl/calibrate/calibrate_told.h"

#include <errno.h>
#include <stdio.h>

static void complain(const char *name, const struct picture_counts *n, const struct board *board,
		     double blur_max_px, struct diag *diag)
{
	if (!n->pictures && !n->unchanged)
		diag_add(diag,
			 "camera %s: no picture of it came; look what stagectl status says of it",
			 name);
	else if (n->mirrored && !n->good)
		diag_add(
			diag,
			"camera %s: its pictures are mirrored: no tag can be read, but their "
			"mirror images can; switch off the camera's flip (ReverseX), and take away "
			"any mirror from its path",
			name);
	else if (n->other > n->good)
		diag_add(
			diag,
			"camera %s: %u of %u pictures show another board than %d x %d squares with "
			"tags from %d on; count the squares, and correct calibration.board",
			name, n->other, n->pictures, board->squares_x, board->squares_y,
			board->first_id);
	else if (n->blurred > n->good)
		diag_add(diag,
			 "camera %s: %u of %u views are blurred (%.1f px, at most %.1f px); wave "
			 "slower, light more, or focus the lens",
			 name, n->blurred, n->blurred + n->good, n->blur_px, blur_max_px);
}

int calibrate_check_pictures(const struct observations *observations,
			     const struct picture_counts *counts, const struct board *board,
			     double blur_max_px, struct diag *diag)
{
	int before = diag->count;

	for (uint32_t c = 0; c < observations->camera_count; c++)
		complain(observations->cameras[c].name, &counts[c], board, blur_max_px, diag);
	if (diag->count > before)
		return -EINVAL;
	for (uint32_t c = 0; c < observations->camera_count; c++)
		if (counts[c].apart)
			fprintf(stderr,
				"camera %s: %u views were exposed up to %.2f ms apart from the "
				"other cameras' and link it to none; calibrate with all exposures "
				"at one time\n",
				observations->cameras[c].name, counts[c].apart, counts[c].apart_ms);
	return 0;
}
