/*
 * The short way to a spot: most are small, round and alone, and a square of sixteen pixels holds
 * all of them. Whatever is not so simple goes the long way over runs.
 */
#include <simde/x86/avx2.h>

#include "track/blobs/blobs_parts.h"

typedef simde__m256i rows2;  /* two rows of sixteen pixels */
typedef simde__m256i rows16; /* sixteen rows, a bit per pixel */

/* Where a whole spot lies in its patch. */
struct patch {
	int first, last;  /* rows of the spot; half open */
	unsigned columns; /* all rows together */
};

/* Rows 2 `pair` and the next. */
static inline rows2 load_pair(const uint8_t *pixels, ptrdiff_t stride_bytes, int pair)
{
	const uint8_t *p = pixels + 2 * pair * stride_bytes;

	return simde_mm256_inserti128_si256(
		simde_mm256_castsi128_si256(simde_mm_loadu_si128((const simde__m128i *)p)),
		simde_mm_loadu_si128((const simde__m128i *)(p + stride_bytes)), 1);
}

static inline rows2 dark_of(rows2 over)
{
	return simde_mm256_cmpeq_epi8(over, simde_mm256_setzero_si256());
}

/* The dark pixels of four rows, 16 bits a row. */
static inline uint64_t dark_bits(rows2 upper, rows2 lower, rows2 level)
{
	uint32_t a =
		(uint32_t)simde_mm256_movemask_epi8(dark_of(simde_mm256_subs_epu8(upper, level)));
	uint32_t b =
		(uint32_t)simde_mm256_movemask_epi8(dark_of(simde_mm256_subs_epu8(lower, level)));

	return (uint64_t)b << 32 | a;
}

/* The rows' bright pixels, from what is dark. */
static inline rows16 bright_rows(const uint64_t dark[PATCH_PX / 4])
{
	return simde_mm256_xor_si256(simde_mm256_set_epi64x((int64_t)dark[3], (int64_t)dark[2],
							    (int64_t)dark[1], (int64_t)dark[0]),
				     simde_mm256_set1_epi8(-1));
}

static rows16 find_bright(const uint8_t *pixels, ptrdiff_t stride_bytes, grey threshold)
{
	rows2 level = simde_mm256_set1_epi8((char)threshold);
	uint64_t dark[PATCH_PX / 4];

	for (int quad = 0; quad < PATCH_PX / 4; quad++)
		dark[quad] = dark_bits(load_pair(pixels, stride_bytes, 2 * quad),
				       load_pair(pixels, stride_bytes, 2 * quad + 1), level);
	return bright_rows(dark);
}

/* The same, and a copy of the pixels. */
static inline rows16 find_and_copy(const uint8_t *pixels, ptrdiff_t stride_bytes, grey threshold,
				   struct feed *feed, uint8_t *copy)
{
	rows2 level = simde_mm256_set1_epi8((char)threshold);
	uint64_t dark[PATCH_PX / 4];

#pragma GCC unroll 4
	for (int quad = 0; quad < PATCH_PX / 4; quad++) {
		rows2 upper = load_pair(pixels, stride_bytes, 2 * quad);
		rows2 lower = load_pair(pixels, stride_bytes, 2 * quad + 1);
		rows2 *out = (rows2 *)(void *)(copy + (ptrdiff_t)4 * PATCH_PX * quad);

		simde_mm256_storeu_si256(out, upper);
		simde_mm256_storeu_si256(out + 1, lower);
		dark[quad] = dark_bits(upper, lower, level);
		feed_on(feed);
	}
	return bright_rows(dark);
}

static unsigned bits_of(rows16 v)
{
	return (unsigned)simde_mm256_movemask_epi8(v);
}

static unsigned any_bit16(rows16 rows)
{
	simde__m128i v = simde_mm_or_si128(simde_mm256_castsi256_si128(rows),
					   simde_mm256_extracti128_si256(rows, 1));

	v = simde_mm_or_si128(v, simde_mm_srli_si128(v, 8));
	v = simde_mm_or_si128(v, simde_mm_srli_si128(v, 4));
	v = simde_mm_or_si128(v, simde_mm_srli_si128(v, 2));
	return (unsigned)simde_mm_cvtsi128_si32(v) & 0xffff;
}

/* One run in each row from some first to `last`, each touching the next, and nothing else. */
static inline bool is_whole(rows16 row, struct patch *patch)
{
	rows16 zero = simde_mm256_setzero_si256();
	rows16 above =
		simde_mm256_alignr_epi8(row, simde_mm256_permute2x128_si256(row, row, 0x08), 14);
	rows16 lowest = simde_mm256_and_si256(row, simde_mm256_sub_epi16(zero, row));
	rows16 second_run = simde_mm256_and_si256(row, simde_mm256_add_epi16(row, lowest));
	rows16 reach =
		simde_mm256_or_si256(simde_mm256_or_si256(above, simde_mm256_slli_epi16(above, 1)),
				     simde_mm256_srli_epi16(above, 1));
	/* Two bits a row. */
	unsigned full = ~bits_of(simde_mm256_cmpeq_epi16(row, zero)), low = full & -full;
	unsigned single = bits_of(simde_mm256_cmpeq_epi16(second_run, zero));
	unsigned loose =
		full & bits_of(simde_mm256_cmpeq_epi16(simde_mm256_and_si256(row, reach), zero));

	if (!full || full & (full + low) || ~single || loose != 3 * low)
		return false;
	patch->first = __builtin_ctz(full) / 2;
	patch->last = (32 - __builtin_clz(full)) / 2;
	patch->columns = any_bit16(row);
	return true;
}

static inline bool is_simple(rows16 bright, struct patch *patch)
{
	return is_whole(bright, patch) && patch->first == PATCH_ABOVE &&
	       patch->last <= PATCH_PX - PATCH_BORDER_PX && !(patch->columns & 0xc003);
}

bool spot_is_whole(const struct spot *spot, const struct grey_image *image, int level)
{
	struct patch patch;

	if (spot->x1 - spot->x0 > PATCH_PX || spot->y1 - spot->y0 > PATCH_PX ||
	    spot->x0 + PATCH_PX > image->width_px || spot->y0 + PATCH_PX > image->height_px)
		return false;
	return is_whole(
		find_bright(grey_row(image, spot->y0) + spot->x0, image->stride_bytes, (grey)level),
		&patch);
}

/* Where the next spot will be written: the image has pushed it out of the cache. */
static void expect_spot(const struct run_table *table)
{
	const char *spot = (const char *)&table->spots[table->spot_count];

	for (size_t b = 0; b < 2 * sizeof(struct spot); b += LINE_BYTES)
		__builtin_prefetch(spot + b, 1);
}

static struct spot *append_spot(struct run_table *table, const struct patch *patch, int x, int y,
				grey level)
{
	uint32_t s = table->spot_count++;
	struct spot *spot = &table->spots[s];

	spot->parent = s;
	spot->first_run = spot->last_run = RUN_NONE;
	spot->x0 = x + __builtin_ctz(patch->columns);
	spot->x1 = x + 32 - __builtin_clz(patch->columns);
	spot->y0 = y + PATCH_ABOVE;
	spot->y1 = y + patch->last;
	spot->level = level;
	spot->merged = false;
	return spot;
}

bool run_table_add_patch(struct run_table *table, const struct grey_image *image, int x, int y,
			 grey level, struct feed *feed)
{
	int left = x - PATCH_PX / 2, top = y - PATCH_ABOVE, side, height;
	struct patch_copy *copy = &table->copies[table->spot_count % COPY_COUNT];
	struct patch patch;
	struct spot *spot;
	rows16 bright;

	if (left < 0 || top < 0 || left + PATCH_PX > image->width_px ||
	    top + PATCH_PX > image->height_px || table->spot_count == SPOT_MAX)
		return false;
	copy->spot = SPOT_NONE;
	bright = find_and_copy(grey_row(image, top) + left, image->stride_bytes, level, feed,
			       copy->pixels);
	if (!is_simple(bright, &patch))
		return false;
	copy->spot = table->spot_count;
	copy->x0 = left;
	copy->y0 = top;
	spot = append_spot(table, &patch, left, top, level);
	spot_sum_patch(spot, copy);
	expect_spot(table);
	/* Beyond the patch nothing is known. Above it, what is bright has been found before. */
	side = spot->x0 + spot->x1 - 1 - 2 * left;
	side = side < 2 * (PATCH_PX - 1) - side ? side : 2 * (PATCH_PX - 1) - side;
	height = 2 * (top + PATCH_PX - 1) - (spot->y0 + spot->y1 - 1);
	spot->clear_px = 0.5f * (float)(side < height ? side : height);
	return true;
}
