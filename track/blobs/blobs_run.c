/*
 * The way of an image through the finder's parts.
 */
#include <string.h>

#include "track/blobs/blobs_parts.h"

#define WORK_ROWS 8     /* the scan goes so far before the work behind it gets a share */
#define PAGE_BYTES 4096 /* the least that there is */
#define PAGES_AHEAD 16
#define LAG_ROWS (MEASURE_LAG_ROWS - 1) /* thresholds come from pixels up to so far below */

/* The pixels of a group; those of a group cut by the image's border are copied and padded with
 * black. */
static const grey *group_pixels(const struct grey_image *image, int y, int x, grey padded[GROUP_PX])
{
	const grey *p = grey_row(image, y) + x;

	if (x + GROUP_PX <= image->width_px)
		return p;
	memset(padded, 0, GROUP_PX * sizeof(*p));
	memcpy(padded, p, (size_t)(image->width_px - x) * sizeof(*p));
	return padded;
}

/* The last group of row y, when the image's border cuts it. */
static size_t scan_tail(struct blob_finder *finder, const struct grey_image *image, int y,
			struct candidate *out)
{
	int whole = image->width_px / GROUP_PX;
	grey padded[GROUP_PX];

	if (whole == finder->group_count ||
	    !blob_scan(group_pixels(image, y, whole * GROUP_PX, padded), y,
		       (const grey *)finder->coarse + (size_t)whole * CELL_PX, 1, out))
		return 0;
	out->group = (uint16_t)whole;
	return 1;
}

/* Takes the pixels of spots already found off the mask; no branches to guess wrong. */
static uint64_t unclaimed(const struct claim *claims, int y, uint64_t mask)
{
	for (int k = 0; k < CLAIM_COUNT; k++)
		mask &= ~(claims[k].mask & -(uint64_t)(y <= claims[k].last_y));
	return mask;
}

/* Keeps later rows of pixels [x0, x1), a little widened, from being looked at again. */
static void claim(struct blob_finder *finder, int y, int x0, int x1, int last_y)
{
	for (int group = (x0 - 1) / GROUP_PX; group <= x1 / GROUP_PX; group++) {
		struct claim *claims = finder->groups[group].claims;
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
		if (finder->groups[group].claims[CLAIM_COUNT - 1].last_y >= y)
			return false;
	return true;
}

/* Looks over the group's rows below y for as long as the claims made in row y and the levels hold:
 * mostly there is nothing else, and the candidates in them need not be looked at one by one. */
static void look_ahead(struct blob_finder *finder, const struct grey_image *image, int y, int group,
		       int last_y)
{
	struct group_state *state = &finder->groups[group];
	int cell_end = (y / CELL_PX + 1) * CELL_PX - 1, x = group * GROUP_PX;
	uint64_t mask;

	last_y = last_y < cell_end ? last_y : cell_end;
	last_y = last_y < image->height_px ? last_y : image->height_px - 1;
	if (x + GROUP_PX > image->width_px || last_y <= y)
		return;
	mask = blob_mask_rows(grey_row(image, y + 1) + x, image->stride_bytes, last_y - y,
			      group_cells(state));
	if (!unclaimed(state->claims, last_y, mask))
		state->quiet_y = last_y;
}

/* Spots that go the short way, one after another along the row. Returns what is left of the mask.
 */
static uint64_t take_patches(struct blob_finder *finder, const struct grey_image *image, int y,
			     int group, uint64_t mask)
{
	struct group_state *state = &finder->groups[group];
	const grey *cells = group_cells(state);

	while (mask) {
		int from = __builtin_ctzll(mask);
		uint64_t gap = ~(mask >> from);
		int end = from + (gap ? __builtin_ctzll(gap) : GROUP_PX);
		int x = group * GROUP_PX + (from + end) / 2;
		grey level = cells[0] < cells[GROUP_PX - 1] ? cells[0] : cells[GROUP_PX - 1];
		const struct spot *spot;

		if (!can_claim(finder, y, x) ||
		    !run_table_add_patch(&finder->table, image, x, y, level, &finder->feed))
			break;
		spot = &finder->table.spots[finder->table.spot_count - 1];
		claim(finder, y, spot->x0, spot->x1, spot->y1);
		mask = unclaimed(state->claims, y, mask);
		if (!mask)
			look_ahead(finder, image, y, group, spot->y1);
	}
	return mask;
}

/* What is bright in a group and new. */
static void find_new(struct blob_finder *finder, const struct grey_image *image, int y, int group,
		     uint64_t mask)
{
	struct group_state *state = &finder->groups[group];
	bool goes_on =
		state->long_way_y >= y - 1 || (mask & 1 && group > 0 && state[-1].long_way_y == y);

	if (!goes_on)
		mask = take_patches(finder, image, y, group, mask);
	if (!mask)
		return;
	state->long_way_y = y;
	run_table_add(&finder->table, y, group * GROUP_PX, mask, group_cells(state));
}

/* A candidate again, against the threshold of its place. */
static inline void find_spots(struct blob_finder *finder, const struct grey_image *image,
			      struct candidate candidate)
{
	int y = candidate.y, group = candidate.group;
	struct group_state *state = &finder->groups[group];
	grey padded[GROUP_PX];
	uint64_t mask;

	if (state->cells_y != y / CELL_PX) {
		state->cells_y = y / CELL_PX;
		level_map_cells(&finder->map, state->cells_y, group, group_cells(state));
	}
	mask = blob_mask(group_pixels(image, y, group * GROUP_PX, padded), group_cells(state));
	mask = unclaimed(state->claims, y, mask);
	if (mask)
		find_new(finder, image, y, group, mask);
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

/* Candidates in rows above `end_y`. */
static void look_at_candidates(struct blob_finder *finder, const struct grey_image *image,
			       int end_y)
{
	const struct candidate *next = finder->candidates + finder->candidates_done;
	const struct candidate *end = finder->candidates + finder->candidate_count;

	for (; next < end && next->y < end_y; next++) {
		if (next->y <= finder->groups[next->group].quiet_y)
			continue;
		feed_on(&finder->feed);
		find_spots(finder, image, *next);
	}
	finder->candidates_done = (size_t)(next - finder->candidates);
}

/* A share of the work behind the scan, whose front is row y: more when much is waiting. Runs are
 * never left behind, so that spots can rely on MEASURE_LAG_ROWS. */
static void work(struct blob_finder *finder, const struct grey_image *image, int y)
{
	uint32_t steps = WORK_ROWS + (finder->table.spot_count - finder->measurer.next) / 32;

	feed_from(&finder->feed, image, y);
	look_at_candidates(finder, image, y - LAG_ROWS);
	while (steps--) {
		feed_on(&finder->feed);
		if (!measurer_step(&finder->measurer, y))
			break;
	}
}

static void reset_groups(struct blob_finder *finder)
{
	for (int g = 0; g < finder->group_count; g++) {
		struct group_state *state = &finder->groups[g];

		state->cells_y = state->long_way_y = state->quiet_y = -2;
		for (int k = 0; k < CLAIM_COUNT; k++)
			state->claims[k].last_y = -1;
	}
}

/* Has the address of a pixel further down translated when the scan enters a page: the walk through
 * the page tables would hold it up, and the pixels that come by themselves end at the page. More
 * than one line of a page would disturb these. */
static void expect_page(const uint8_t *row, int stride_bytes)
{
	uintptr_t here = (uintptr_t)row, next = here + (uintptr_t)stride_bytes;

	if (here / PAGE_BYTES != next / PAGE_BYTES)
		__builtin_prefetch(row + PAGES_AHEAD * PAGE_BYTES);
}

/* The scan waits for memory most of the time. The work on what it has found follows so closely that
 * most rows it looks at are still in the first cache, and in few portions: after each the processor
 * must find out anew that it is to read ahead. */
static void scan_image(struct blob_finder *finder, const struct grey_image *image)
{
	int whole = image->width_px / GROUP_PX, coarse_end = 0;
	const uint8_t *row = image->pixels;

	finder->candidate_count = finder->candidates_done = 0;
	finder->feed = (struct feed){image->pixels, image->pixels};
	reset_groups(finder);
	for (int y = 0; y < image->height_px; y++, row += image->stride_bytes) {
		struct candidate *next = finder->candidates + finder->candidate_count;

		expect_page(row, image->stride_bytes);
		if (y % CELL_PX == 0)
			level_map_expect(&finder->map, y / CELL_PX);
		if (y == coarse_end)
			coarse_end = level_map_coarse(&finder->map, y, finder->coarse);
		finder->candidate_count +=
			blob_scan(grey_row(image, y), y, finder->coarse, whole, next);
		if (whole < finder->group_count)
			finder->candidate_count += scan_tail(
				finder, image, y, finder->candidates + finder->candidate_count);
		if ((y + 1) % WORK_ROWS == 0)
			work(finder, image, y);
	}
	look_at_candidates(finder, image, image->height_px);
}

void blob_run(struct blob_finder *finder, const struct grey_image *image, struct blob_set *set)
{
	struct run_table *table = &finder->table;
	struct blob_settings settings = finder->settings;
	struct spot_scene scene = {image, &finder->map, &settings, table->runs, &finder->feed};

	settings.threshold_min *= (double)grey_unit(image);
	settings.electrons_per_grey /= (double)grey_unit(image);
	run_table_reset(table);
	measurer_start(&finder->measurer, &scene, table, set);
	level_map_start(&finder->map, image, &settings);
	scan_image(finder, image);
	measurer_end(&finder->measurer);
}
