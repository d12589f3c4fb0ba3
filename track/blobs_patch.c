/*
 * The short way to a spot: most are small, round and alone, and a square of sixteen pixels holds
 * all of them. Whatever is not so simple goes the long way over runs.
 */
#include "track/blobs_parts.h"
#include "track/blobs_weights.h"

#define BORDER_PX 2 /* dark pixels that the patch must have on all sides */

struct patch {
	const uint8_t *pixels;   /* top left */
	uint16_t rows[PATCH_PX]; /* bit x: the pixel is bright */
	int last;                /* row after the spot's last */
	uint16_t columns;        /* all rows together */
};

static void find_bright(struct patch *patch, ptrdiff_t stride_bytes, vec level, struct feed *feed)
{
	const uint8_t *p = patch->pixels;

	for (int y = 0; y < PATCH_PX; y++, p += stride_bytes) {
		vec over = simde_mm_subs_epu8(simde_mm_loadu_si128((const vec *)p), level);
		vec dark = simde_mm_cmpeq_epi8(over, simde_mm_setzero_si128());

		if (y % 4 == 0)
			feed_on(feed);
		patch->rows[y] = (uint16_t)~simde_mm_movemask_epi8(dark);
	}
}

/* One run in each row from PATCH_ABOVE to `last`, each touching the next, and nothing else. */
static bool is_simple(struct patch *patch)
{
	unsigned touch = 0xffff, all = 0, rest = 0;
	int y = PATCH_ABOVE;

	for (; y < PATCH_PX - BORDER_PX && patch->rows[y]; y++) {
		unsigned row = patch->rows[y], low = row & -row;

		if (row & (row + low) || !(row & touch))
			return false;
		touch = row | row << 1 | row >> 1;
		all |= row;
	}
	patch->last = y;
	patch->columns = (uint16_t)all;
	for (; y < PATCH_PX; y++)
		rest |= patch->rows[y];
	return !rest && !patch->rows[0] && !patch->rows[1] && all && !(all & 0xc003);
}

/* The spot with its runs, which are kept apart from those of the rows. */
static struct spot *append_spot(struct run_table *table, const struct patch *patch, int x, int y,
				uint8_t level)
{
	uint32_t s = table->spot_count++, r = table->patch_first;
	struct spot *spot = &table->spots[s];

	*spot = (struct spot){.parent = s, .level = level, .last_run = r - 1};
	spot->x0 = x + __builtin_ctz(patch->columns);
	spot->x1 = x + 32 - __builtin_clz(patch->columns);
	spot->y0 = y + PATCH_ABOVE;
	spot->y1 = y + patch->last;
	for (int k = patch->last - 1; k >= PATCH_ABOVE; k--) {
		unsigned row = patch->rows[k];
		int x0 = x + __builtin_ctz(row), x1 = x + 32 - __builtin_clz(row);

		table->runs[--r] = (struct run){(uint16_t)(y + k),
						(uint16_t)x0,
						(uint16_t)x1,
						level,
						s,
						k == patch->last - 1 ? RUN_NONE : r + 1};
		spot->area_px2 += x1 - x0;
		spot_add_area(&spot->area, y + k, x0, x1);
	}
	spot->first_run = table->patch_first = r;
	return spot;
}

static void sum_weights(struct feed *feed, struct spot *spot, const struct patch *patch,
			ptrdiff_t stride_bytes, vec level, int left)
{
	const uint8_t *p = patch->pixels + PATCH_ABOVE * stride_bytes;
	vec zero = simde_mm_setzero_si128();
	struct weight_sums sums = {zero, zero, zero, zero};

	for (int dy = 0; dy < spot->y1 - spot->y0; dy++, p += stride_bytes) {
		vec v = simde_mm_loadu_si128((const vec *)p);

		feed_on(feed);
		sums.peak = simde_mm_max_epu8(sums.peak, v);
		add_chunk(&sums, simde_mm_subs_epu8(v, level), left, dy);
	}
	spot->w = total(sums.w);
	spot->wx = total(sums.wx);
	spot->wy = total(sums.wy);
	spot->peak = greatest(sums.peak);
}

bool run_table_add_patch(struct run_table *table, const struct grey_image *image, int x, int y,
			 uint8_t level, struct feed *feed)
{
	int left = x - PATCH_PX / 2, top = y - PATCH_ABOVE, side, height;
	vec levels = simde_mm_set1_epi8((char)level);
	struct patch patch;
	struct spot *spot;

	if (left < 0 || top < 0 || left + PATCH_PX > image->width_px ||
	    top + PATCH_PX > image->height_px || table->spot_count == SPOT_MAX ||
	    table->patch_first - table->run_count < PATCH_PX)
		return false;
	patch.pixels = image->pixels + (ptrdiff_t)top * image->stride_bytes + left;
	find_bright(&patch, image->stride_bytes, levels, feed);
	if (!is_simple(&patch))
		return false;
	spot = append_spot(table, &patch, left, top, level);
	sum_weights(feed, spot, &patch, image->stride_bytes, levels, left - spot->x0);
	spot_area_moments(spot);
	/* Beyond the patch nothing is known. Above it, what is bright has been found before. */
	side = spot->x0 + spot->x1 - 1 - 2 * left;
	side = side < 2 * (PATCH_PX - 1) - side ? side : 2 * (PATCH_PX - 1) - side;
	height = 2 * (top + PATCH_PX - 1) - (spot->y0 + spot->y1 - 1);
	spot->clear_px = 0.5f * (float)(side < height ? side : height);
	return true;
}
