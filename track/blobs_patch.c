/*
 * The short way to a spot: most are small, round and alone, and a square of sixteen pixels holds
 * all of them. Whatever is not so simple goes the long way over runs.
 */
#include "track/blobs_parts.h"
#include "track/blobs_weights.h"

#define BORDER_PX 2 /* dark pixels that the patch must have on all sides */

struct patch {
	const uint8_t *pixels; /* top left */
	/* Bit x: the pixel is bright; a dark row before and behind. */
	uint16_t padded[PATCH_PX + 2];
	int first, last;  /* rows of the spot; half open */
	unsigned columns; /* all rows together */
};

#define ROWS(patch) ((patch)->padded + 1)

static void find_bright(struct patch *patch, ptrdiff_t stride_bytes, vec level, struct feed *feed)
{
	const uint8_t *p = patch->pixels;

	patch->padded[0] = patch->padded[PATCH_PX + 1] = 0;
	for (int y = 0; y < PATCH_PX; y++, p += stride_bytes) {
		vec over = simde_mm_subs_epu8(simde_mm_loadu_si128((const vec *)p), level);
		vec dark = simde_mm_cmpeq_epi8(over, simde_mm_setzero_si128());

		if (y % 4 == 0)
			feed_on(feed);
		ROWS(patch)[y] = (uint16_t)~simde_mm_movemask_epi8(dark);
	}
}

/* What is_simple() asks of eight rows at once; a bit per row and byte. */
struct eight_rows {
	unsigned empty, broken, loose;
};

static inline struct eight_rows look_at_rows(const uint16_t *rows, vec *columns)
{
	vec zero = simde_mm_setzero_si128(),
	    row = simde_mm_loadu_si128((const vec *)(const void *)rows);
	vec above = simde_mm_loadu_si128((const vec *)(const void *)(rows - 1));
	vec lowest = simde_mm_and_si128(row, simde_mm_sub_epi16(zero, row));
	vec second_run = simde_mm_and_si128(row, simde_mm_add_epi16(row, lowest));
	vec reach = simde_mm_or_si128(simde_mm_or_si128(above, simde_mm_slli_epi16(above, 1)),
				      simde_mm_srli_epi16(above, 1));

	*columns = simde_mm_or_si128(*columns, row);
	return (struct eight_rows){
		(unsigned)simde_mm_movemask_epi8(simde_mm_cmpeq_epi16(row, zero)),
		~(unsigned)simde_mm_movemask_epi8(simde_mm_cmpeq_epi16(second_run, zero)) & 0xffff,
		(unsigned)simde_mm_movemask_epi8(
			simde_mm_cmpeq_epi16(simde_mm_and_si128(row, reach), zero)),
	};
}

static unsigned any_bit16(vec v)
{
	v = simde_mm_or_si128(v, simde_mm_srli_si128(v, 8));
	v = simde_mm_or_si128(v, simde_mm_srli_si128(v, 4));
	v = simde_mm_or_si128(v, simde_mm_srli_si128(v, 2));
	return (unsigned)simde_mm_cvtsi128_si32(v) & 0xffff;
}

/* One run in each row from some first to `last`, each touching the next, and nothing else. */
static bool is_whole(struct patch *patch)
{
	vec columns = simde_mm_setzero_si128();
	struct eight_rows upper = look_at_rows(ROWS(patch), &columns);
	struct eight_rows lower = look_at_rows(ROWS(patch) + 8, &columns);
	unsigned full = ~(upper.empty | lower.empty << 16); /* two bits a row */
	unsigned broken = upper.broken | lower.broken << 16, low = full & -full, first = 3 * low;
	unsigned loose = (upper.loose | lower.loose << 16) & full;

	if (!full || full & (full + low) || broken || loose != first)
		return false;
	patch->first = __builtin_ctz(full) / 2;
	patch->last = (32 - __builtin_clz(full)) / 2;
	patch->columns = any_bit16(columns);
	return true;
}

static bool is_simple(struct patch *patch)
{
	return is_whole(patch) && patch->first == PATCH_ABOVE &&
	       patch->last <= PATCH_PX - BORDER_PX && !(patch->columns & 0xc003);
}

bool spot_is_whole(const struct spot *spot, const struct grey_image *image, int level,
		   struct feed *feed)
{
	struct patch patch;

	if (spot->x1 - spot->x0 > PATCH_PX || spot->y1 - spot->y0 > PATCH_PX ||
	    spot->x0 + PATCH_PX > image->width_px || spot->y0 + PATCH_PX > image->height_px)
		return false;
	patch.pixels = image->pixels + (ptrdiff_t)spot->y0 * image->stride_bytes + spot->x0;
	find_bright(&patch, image->stride_bytes, simde_mm_set1_epi8((char)level), feed);
	return is_whole(&patch);
}

/* Where the next spot and its runs will be written: the image has pushed them out of the cache. */
static void expect_spot(const struct run_table *table)
{
	const char *spot = (const char *)&table->spots[table->spot_count];

	for (size_t b = 0; b < 2 * sizeof(struct spot); b += LINE_BYTES)
		__builtin_prefetch(spot + b, 1);
	__builtin_prefetch(&table->runs[table->patch_first - PATCH_PX], 1);
	__builtin_prefetch(&table->runs[table->patch_first - PATCH_PX / 2], 1);
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
		unsigned row = ROWS(patch)[k];
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
	expect_spot(table);
	/* Beyond the patch nothing is known. Above it, what is bright has been found before. */
	side = spot->x0 + spot->x1 - 1 - 2 * left;
	side = side < 2 * (PATCH_PX - 1) - side ? side : 2 * (PATCH_PX - 1) - side;
	height = 2 * (top + PATCH_PX - 1) - (spot->y0 + spot->y1 - 1);
	spot->clear_px = 0.5f * (float)(side < height ? side : height);
	return true;
}
