/*
 * Pixels of 16 bits have no short ways: every spot goes the long one over its runs.
 */
#include "track/blobs/blobs_parts.h"

bool run_table_add_patch(struct run_table *table, const struct grey_image *image, int x, int y,
			 grey level, struct feed *feed)
{
	(void)table, (void)image, (void)x, (void)y, (void)level, (void)feed;
	return false;
}

bool spot_is_whole(const struct spot *spot, const struct grey_image *image, int level)
{
	(void)spot, (void)image, (void)level;
	return false;
}

bool spot_sum_short(struct spot *spot, const struct run *runs, const struct grey_image *image)
{
	(void)spot, (void)runs, (void)image;
	return false;
}
