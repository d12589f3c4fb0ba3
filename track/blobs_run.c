/*
 * The way of an image through the finder's parts.
 */
#include <string.h>

#include "track/blobs_parts.h"

#define LAG_ROWS (MEASURE_LAG_ROWS - 1) /* thresholds come from pixels up to so far below */

/* The pixels of a group; those of a group cut by the image's border are copied and padded with
 * black. */
static const uint8_t *group_pixels(const struct grey_image *image, int y, int x,
				   uint8_t padded[GROUP_PX])
{
	const uint8_t *p = image->pixels + (ptrdiff_t)y * image->stride_bytes + x;

	if (x + GROUP_PX <= image->width_px)
		return p;
	memset(padded, 0, GROUP_PX);
	memcpy(padded, p, (size_t)(image->width_px - x));
	return padded;
}

/* The last group of row y, when the image's border cuts it. */
static size_t scan_tail(struct blob_finder *finder, const struct grey_image *image, int y,
			struct candidate *out)
{
	int whole = image->width_px / GROUP_PX;
	uint8_t padded[GROUP_PX];

	if (whole == finder->group_count ||
	    !blob_scan(group_pixels(image, y, whole * GROUP_PX, padded), y,
		       finder->coarse + (size_t)whole * CELL_PX, 1, out))
		return 0;
	out->group = (uint16_t)whole;
	return 1;
}

/* Takes the pixels of spots already found off the mask. */
static uint64_t unclaimed(const struct claim *claims, int y, uint64_t mask)
{
	for (int k = 0; k < CLAIM_COUNT; k++)
		if (y <= claims[k].last_y)
			mask &= ~claims[k].mask;
	return mask;
}

/* Keeps later rows of pixels [x0, x1), a little widened, from being looked at again. */
static void claim(struct blob_finder *finder, int y, int x0, int x1, int last_y)
{
	for (int group = (x0 - 1) / GROUP_PX; group <= x1 / GROUP_PX; group++) {
		struct claim *claims = finder->claims + (ptrdiff_t)group * CLAIM_COUNT;
		int from = x0 - 1 - group * GROUP_PX, end = x1 + 1 - group * GROUP_PX;
		uint64_t mask = ~0ULL << (from > 0 ? from : 0);

		mask &= end < GROUP_PX ? ~(~0ULL << end) : ~0ULL;
		while (claims->last_y >= y)
			claims++;
		*claims = (struct claim){mask, last_y};
	}
}

/* Whether both groups that a patch may touch have room for a claim. */
static bool can_claim(const struct blob_finder *finder, int y, int x)
{
	int first = (x - PATCH_PX / 2) / GROUP_PX, last = (x + PATCH_PX / 2) / GROUP_PX;

	last = last < finder->group_count ? last : finder->group_count - 1;
	for (int group = first > 0 ? first : 0; group <= last; group++)
		if (finder->claims[(ptrdiff_t)(group + 1) * CLAIM_COUNT - 1].last_y >= y)
			return false;
	return true;
}

/* Spots that go the short way, one after another along the row. Returns what is left of the mask.
 */
static uint64_t take_patches(struct blob_finder *finder, const struct grey_image *image, int y,
			     int group, uint64_t mask)
{
	const uint8_t *cells = finder->cells + group * GROUP_PX;

	while (mask) {
		int from = __builtin_ctzll(mask);
		uint64_t gap = ~(mask >> from);
		int end = from + (gap ? __builtin_ctzll(gap) : GROUP_PX);
		int x = group * GROUP_PX + (from + end) / 2;
		uint8_t level = cells[0] < cells[GROUP_PX - 1] ? cells[0] : cells[GROUP_PX - 1];
		const struct spot *spot;

		if (!can_claim(finder, y, x) ||
		    !run_table_add_patch(&finder->table, image, x, y, level, &finder->feed))
			break;
		spot = &finder->table.spots[finder->table.spot_count - 1];
		claim(finder, y, spot->x0, spot->x1, spot->y1);
		mask = unclaimed(finder->claims + group * CLAIM_COUNT, y, mask);
	}
	return mask;
}

/* Candidate i again, against the threshold of its place. */
static void find_spots(struct blob_finder *finder, const struct grey_image *image, size_t i)
{
	int y = finder->candidates[i].y, group = finder->candidates[i].group;
	uint8_t padded[GROUP_PX], *cells = finder->cells + group * GROUP_PX;
	int x = group * GROUP_PX, cell_y = y / CELL_PX;
	uint64_t mask;

	if (finder->cells_y[group] != cell_y) {
		finder->cells_y[group] = cell_y;
		level_map_cells(&finder->map, cell_y, group, cells);
	}
	mask = blob_mask(group_pixels(image, y, x, padded), cells);
	mask = unclaimed(finder->claims + group * CLAIM_COUNT, y, mask);
	if (!mask)
		return;
	if (finder->long_way_y[group] < y - 1 &&
	    !(mask & 1 && group > 0 && finder->long_way_y[group - 1] == y))
		mask = take_patches(finder, image, y, group, mask);
	if (!mask)
		return;
	finder->long_way_y[group] = y;
	run_table_add(&finder->table, y, x, mask, cells);
}

/* The rows that the scan comes to next. */
static void feed_from(struct feed *feed, const struct grey_image *image, int y)
{
	const uint8_t *end = image->pixels + (ptrdiff_t)image->height_px * image->stride_bytes;
	const uint8_t *next = image->pixels + (ptrdiff_t)(y + 1) * image->stride_bytes;

	feed->next = feed->next > next ? feed->next : next;
	feed->end = end - next > FEED_ROWS * image->stride_bytes
			    ? next + FEED_ROWS * image->stride_bytes
			    : end;
}

/* A share of the work behind the scan, whose front is row y: more when much is waiting. Runs are
 * never left behind, so that spots can rely on MEASURE_LAG_ROWS. */
static void work(struct blob_finder *finder, const struct grey_image *image, int y)
{
	const struct candidate *candidates = finder->candidates;
	uint32_t steps = 1 + (finder->table.spot_count - finder->measurer.next) / 32;

	feed_from(&finder->feed, image, y);
	while (finder->candidates_done < finder->candidate_count &&
	       candidates[finder->candidates_done].y < y - LAG_ROWS) {
		feed_on(&finder->feed);
		find_spots(finder, image, finder->candidates_done++);
	}
	while (steps--) {
		feed_on(&finder->feed);
		if (!measurer_step(&finder->measurer, y))
			break;
	}
}

/* The scan waits for memory most of the time. The work on what it has found is spread evenly
 * between the rows and hides in these waits - as long as it follows so closely that the rows it
 * looks at are still in the first cache. */
static void scan_image(struct blob_finder *finder, const struct grey_image *image)
{
	int whole = image->width_px / GROUP_PX, coarse_end = 0;
	const uint8_t *row = image->pixels;

	finder->candidate_count = finder->candidates_done = 0;
	finder->feed = (struct feed){image->pixels, image->pixels};
	for (int g = 0; g < finder->group_count; g++)
		finder->cells_y[g] = finder->long_way_y[g] = -2;
	for (int k = 0; k < finder->group_count * CLAIM_COUNT; k++)
		finder->claims[k].last_y = -1;
	for (int y = 0; y < image->height_px; y++, row += image->stride_bytes) {
		struct candidate *next = finder->candidates + finder->candidate_count;

		if (y % CELL_PX == 0)
			level_map_expect(&finder->map, y / CELL_PX);
		if (y == coarse_end)
			coarse_end = level_map_coarse(&finder->map, y, finder->coarse);
		finder->candidate_count += blob_scan(row, y, finder->coarse, whole, next);
		if (whole < finder->group_count)
			finder->candidate_count += scan_tail(
				finder, image, y, finder->candidates + finder->candidate_count);
		if (finder->candidate_count > finder->candidates_done ||
		    measurer_is_due(&finder->measurer, y))
			work(finder, image, y);
	}
	while (finder->candidates_done < finder->candidate_count)
		find_spots(finder, image, finder->candidates_done++);
}

void blob_run(struct blob_finder *finder, const struct grey_image *image, struct blob_set *set)
{
	struct run_table *table = &finder->table;
	struct spot_scene scene = {image, &finder->map, &finder->settings, table->runs,
				   &finder->feed};

	run_table_reset(table);
	measurer_start(&finder->measurer, &scene, table, set);
	level_map_start(&finder->map, image, &finder->settings);
	scan_image(finder, image);
	measurer_end(&finder->measurer);
}
