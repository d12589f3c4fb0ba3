/*
 * The short way to a spot: most are small, round and alone, and a square of sixteen pixels holds
 * all of them. Whatever is not so simple goes the long way over runs.
 */
#include <simde/x86/avx2.h>

#include "track/blobs/blobs_parts.h"
#include "track/blobs/blobs_weights.h"

#define BORDER_PX 2 /* dark pixels that the patch must have on all sides */

typedef simde__m256i words; /* sixteen of 16 bits */

struct patch {
	const uint8_t *pixels; /* top left */
	/* Of four rows each, 16 bits a row: bit x says that the pixel is bright. Read as written:
	 * the processor waits where it reads together what was just written in parts. */
	uint64_t bright[PATCH_PX / 4];
	int first, last;  /* rows of the spot; half open */
	unsigned columns; /* all rows together */
};

/* Sums over the rows that a spot may have, down each column: of bright pixels and of light above
 * the level, times the row's number from 1 on. Adding the sums so far after each row, from the
 * last to the first, does that without a multiplication. */
struct column_sums {
	vec count, count_y, peak;       /* bytes */
	words light, light_y, count_yy; /* the last: times n (n + 1) / 2 */
};

/* Puts the row's bits before those of the rows below it. */
static inline vec look_at_row(const struct patch *patch, ptrdiff_t stride_bytes, int y, vec level,
			      uint64_t *bright, vec *over)
{
	vec v = simde_mm_loadu_si128((const vec *)(patch->pixels + y * stride_bytes));
	unsigned dark;

	*over = simde_mm_subs_epu8(v, level);
	dark = (unsigned)simde_mm_movemask_epi8(
		simde_mm_cmpeq_epi8(*over, simde_mm_setzero_si128()));
	*bright = *bright << 16 | (dark ^ 0xffff);
	return v;
}

static inline void add_row(struct column_sums *sums, vec v, vec over)
{
	sums->peak = simde_mm_max_epu8(sums->peak, v);
	sums->count =
		simde_mm_add_epi8(sums->count, simde_mm_min_epu8(over, simde_mm_set1_epi8(1)));
	sums->count_y = simde_mm_add_epi8(sums->count_y, sums->count);
	sums->count_yy =
		simde_mm256_add_epi16(sums->count_yy, simde_mm256_cvtepu8_epi16(sums->count_y));
	sums->light = simde_mm256_add_epi16(sums->light, simde_mm256_cvtepu8_epi16(over));
	sums->light_y = simde_mm256_add_epi16(sums->light_y, sums->light);
}

static void find_bright(struct patch *patch, ptrdiff_t stride_bytes, vec level)
{
	vec over;

	for (int y = PATCH_PX - 1; y >= 0; y--)
		look_at_row(patch, stride_bytes, y, level, &patch->bright[y / 4], &over);
}

/* The same, and a copy of the pixels, and the sums over the rows from PATCH_ABOVE to BORDER_PX
 * before the end. Four rows a turn: all sixteen in one are more than the registers hold. */
static inline void find_and_sum(struct patch *patch, ptrdiff_t stride_bytes, vec level,
				struct feed *feed, uint8_t *copy, struct column_sums *out)
{
	vec none = simde_mm_setzero_si128(), over;
	words zero = simde_mm256_setzero_si256();
	struct column_sums sums = {none, none, none, zero, zero, zero};

	for (int last = PATCH_PX - 1; last > 0; last -= 4) {
		uint64_t bright = 0;

#pragma GCC unroll 4
		for (int y = last; y > last - 4; y--) {
			vec v = look_at_row(patch, stride_bytes, y, level, &bright, &over);

			simde_mm_storeu_si128((vec *)(void *)(copy + y * PATCH_PX), v);
			if (y >= PATCH_ABOVE && y < PATCH_PX - BORDER_PX)
				add_row(&sums, v, over);
		}
		patch->bright[last / 4] = bright;
		feed_on(feed);
	}
	*out = sums;
}

/* What is_simple() asks of eight rows at once; a bit per row and byte. */
struct eight_rows {
	unsigned empty, broken, loose;
};

static inline struct eight_rows look_at_rows(vec row, vec above)
{
	vec zero = simde_mm_setzero_si128();
	vec lowest = simde_mm_and_si128(row, simde_mm_sub_epi16(zero, row));
	vec second_run = simde_mm_and_si128(row, simde_mm_add_epi16(row, lowest));
	vec reach = simde_mm_or_si128(simde_mm_or_si128(above, simde_mm_slli_epi16(above, 1)),
				      simde_mm_srli_epi16(above, 1));

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
	const uint64_t *bright = patch->bright;
	vec first = simde_mm_set_epi64x((int64_t)bright[1], (int64_t)bright[0]);
	vec second = simde_mm_set_epi64x((int64_t)bright[3], (int64_t)bright[2]);
	struct eight_rows upper = look_at_rows(first, simde_mm_slli_si128(first, 2));
	struct eight_rows lower =
		look_at_rows(second, simde_mm_or_si128(simde_mm_slli_si128(second, 2),
						       simde_mm_srli_si128(first, 14)));
	unsigned full = ~(upper.empty | lower.empty << 16); /* two bits a row */
	unsigned broken = upper.broken | lower.broken << 16, low = full & -full;
	unsigned loose = (upper.loose | lower.loose << 16) & full;

	if (!full || full & (full + low) || broken || loose != 3 * low)
		return false;
	patch->first = __builtin_ctz(full) / 2;
	patch->last = (32 - __builtin_clz(full)) / 2;
	patch->columns = any_bit16(simde_mm_or_si128(first, second));
	return true;
}

static bool is_simple(struct patch *patch)
{
	return is_whole(patch) && patch->first == PATCH_ABOVE &&
	       patch->last <= PATCH_PX - BORDER_PX && !(patch->columns & 0xc003);
}

bool spot_is_whole(const struct spot *spot, const struct grey_image *image, int level)
{
	struct patch patch = {0};

	if (spot->x1 - spot->x0 > PATCH_PX || spot->y1 - spot->y0 > PATCH_PX ||
	    spot->x0 + PATCH_PX > image->width_px || spot->y0 + PATCH_PX > image->height_px)
		return false;
	patch.pixels = image->pixels + (ptrdiff_t)spot->y0 * image->stride_bytes + spot->x0;
	find_bright(&patch, image->stride_bytes, simde_mm_set1_epi8((char)level));
	return is_whole(&patch);
}

/* Where the next spot will be written: the image has pushed it out of the cache. */
static void expect_spot(const struct run_table *table)
{
	const char *spot = (const char *)&table->spots[table->spot_count];

	for (size_t b = 0; b < 2 * sizeof(struct spot); b += LINE_BYTES)
		__builtin_prefetch(spot + b, 1);
}

static words times_x(words columns)
{
	return simde_mm256_madd_epi16(columns, simde_mm256_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7, 8, 9,
								      10, 11, 12, 13, 14, 15));
}

static words times_xx(words columns)
{
	return simde_mm256_madd_epi16(columns,
				      simde_mm256_setr_epi16(0, 1, 4, 9, 16, 25, 36, 49, 64, 81,
							     100, 121, 144, 169, 196, 225));
}

static words pairs(words columns)
{
	return simde_mm256_madd_epi16(columns, simde_mm256_set1_epi16(1));
}

static void totals(words a, words b, words c, words d, int out[4])
{
	words v =
		simde_mm256_hadd_epi32(simde_mm256_hadd_epi32(a, b), simde_mm256_hadd_epi32(c, d));

	simde_mm_storeu_si128((vec *)(void *)out,
			      simde_mm_add_epi32(simde_mm256_castsi256_si128(v),
						 simde_mm256_extracti128_si256(v, 1)));
}

/* From the sums down the columns to those of the spot. The patch begins at column `left`. */
static void set_light(struct spot *spot, const struct column_sums *sums, int left)
{
	int light[4];

	totals(pairs(sums->light), times_x(sums->light), pairs(sums->light_y),
	       simde_mm256_setzero_si256(), light);
	spot->w = light[0];
	spot->wx = light[1] - light[0] * (spot->x0 - left);
	spot->wy = light[2] - light[0];
	spot->peak = greatest(sums->peak);
}

/* As spot_area_moments() does from runs. */
static void set_area(struct spot *spot, const struct column_sums *sums)
{
	words count = simde_mm256_cvtepu8_epi16(sums->count);
	words count_y = simde_mm256_cvtepu8_epi16(sums->count_y);
	int first[4], second[4], n, yy;
	float scale;

	totals(pairs(count), times_x(count), pairs(count_y), simde_mm256_setzero_si256(), first);
	totals(times_xx(count), times_x(count_y), pairs(sums->count_yy),
	       simde_mm256_setzero_si256(), second);
	n = first[0];
	yy = 2 * second[2] - first[2];
	scale = 1 / (float)(n * n);
	spot->area_px2 = n;
	spot->area_xx = (float)(n * second[0] - first[1] * first[1]) * scale + 1 / 12.0f;
	spot->area_xy = (float)(n * second[1] - first[1] * first[2]) * scale;
	spot->area_yy = (float)(n * yy - first[2] * first[2]) * scale + 1 / 12.0f;
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
	struct column_sums sums;
	struct patch patch = {0};
	struct spot *spot;

	if (left < 0 || top < 0 || left + PATCH_PX > image->width_px ||
	    top + PATCH_PX > image->height_px || table->spot_count == SPOT_MAX)
		return false;
	patch.pixels = image->pixels + (ptrdiff_t)top * image->stride_bytes + left;
	copy->spot = SPOT_NONE;
	find_and_sum(&patch, image->stride_bytes, simde_mm_set1_epi8((char)level), feed,
		     copy->pixels, &sums);
	if (!is_simple(&patch))
		return false;
	copy->spot = table->spot_count;
	copy->x0 = left;
	copy->y0 = top;
	spot = append_spot(table, &patch, left, top, level);
	set_light(spot, &sums, left);
	set_area(spot, &sums);
	expect_spot(table);
	/* Beyond the patch nothing is known. Above it, what is bright has been found before. */
	side = spot->x0 + spot->x1 - 1 - 2 * left;
	side = side < 2 * (PATCH_PX - 1) - side ? side : 2 * (PATCH_PX - 1) - side;
	height = 2 * (top + PATCH_PX - 1) - (spot->y0 + spot->y1 - 1);
	spot->clear_px = 0.5f * (float)(side < height ? side : height);
	return true;
}
