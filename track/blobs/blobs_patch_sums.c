/*
 * The sums of a spot that came the short way, over the pixels of its patch's copy: integers, two
 * rows at once, in bytes where they fit.
 */
#include <simde/x86/avx2.h>

#include "track/blobs/blobs_parts.h"
#include "track/blobs/blobs_weights.h"

#define MIDDLE_X 8
#define SUM_PAIRS ((PATCH_PX - PATCH_ABOVE - PATCH_BORDER_PX) / 2)

typedef simde__m256i rows2; /* two rows of sixteen pixels */

/* Sums over the SUM_PAIRS pairs of rows that a spot may have, down each column and of the two rows
 * of a pair apart: of dark pixels (less than nothing) and of light above the level, times the
 * pair's number k from 1 on. Adding the sums so far after each pair, from the last to the first,
 * does that without a multiplication. */
struct column_sums {
	rows2 count, count_k, count_kk, peak; /* bytes; the third: times k (k + 1) / 2 */
	rows2 light, light_k;                 /* eight columns in one, 64 bits */
	rows2 light_x;                        /* two columns in one, times x - MIDDLE_X */
};

static inline rows2 lever_x(void)
{
	const vec x = simde_mm_setr_epi8(-8, -7, -6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6, 7);

	return simde_mm256_set_m128i(x, x);
}

static inline void add_pair(struct column_sums *sums, rows2 v, rows2 over)
{
	sums->peak = simde_mm256_max_epu8(sums->peak, v);
	sums->count = simde_mm256_add_epi8(
		sums->count, simde_mm256_cmpeq_epi8(over, simde_mm256_setzero_si256()));
	sums->count_k = simde_mm256_add_epi8(sums->count_k, sums->count);
	sums->count_kk = simde_mm256_add_epi8(sums->count_kk, sums->count_k);
	sums->light = simde_mm256_add_epi64(
		sums->light, simde_mm256_sad_epu8(over, simde_mm256_setzero_si256()));
	sums->light_k = simde_mm256_add_epi64(sums->light_k, sums->light);
	sums->light_x =
		simde_mm256_add_epi16(sums->light_x, simde_mm256_maddubs_epi16(over, lever_x()));
}

/* Over the rows from PATCH_ABOVE to PATCH_BORDER_PX before the end, read in pairs as they were
 * written.
 */
static inline void sum_columns(const uint8_t *copy, grey threshold, struct column_sums *out)
{
	rows2 zero = simde_mm256_setzero_si256(), level = simde_mm256_set1_epi8((char)threshold);
	struct column_sums sums = {zero, zero, zero, zero, zero, zero, zero};

#pragma GCC unroll 6
	for (int pair = SUM_PAIRS; pair > 0; pair--) {
		rows2 v = simde_mm256_loadu_si256(
			(const rows2 *)(const void *)(copy + (ptrdiff_t)2 * PATCH_PX * pair));

		add_pair(&sums, v, simde_mm256_subs_epu8(v, level));
	}
	*out = sums;
}

/* Of the rows with even numbers, then of those with odd ones. */
struct totals {
	int16_t n, x, xx, k, kx, kk, light_x, none;
};

static rows2 add16(rows2 a, rows2 b)
{
	return simde_mm256_hadd_epi16(a, b);
}

static rows2 times(rows2 columns, rows2 lever)
{
	return simde_mm256_maddubs_epi16(columns, lever);
}

static void find_totals(const struct column_sums *sums, struct totals out[2])
{
	const vec squares =
		simde_mm_setr_epi8(64, 49, 36, 25, 16, 9, 4, 1, 0, 1, 4, 9, 16, 25, 36, 49);
	rows2 one = simde_mm256_set1_epi8(1), x = lever_x();
	rows2 xx = simde_mm256_set_m128i(squares, squares);
	/* No dark pixel: SUM_PAIRS times 1, and the sums of k and k (k + 1) / 2 over all. */
	rows2 count = simde_mm256_add_epi8(sums->count, simde_mm256_set1_epi8(6));
	rows2 count_k = simde_mm256_add_epi8(sums->count_k, simde_mm256_set1_epi8(21));
	rows2 count_kk = simde_mm256_add_epi8(sums->count_kk, simde_mm256_set1_epi8(56));
	rows2 a = add16(add16(times(count, one), times(count, x)),
			add16(times(count, xx), times(count_k, one)));
	rows2 b = add16(add16(times(count_k, x), times(count_kk, one)),
			add16(sums->light_x, simde_mm256_setzero_si256()));

	simde_mm256_storeu_si256((rows2 *)(void *)out, add16(a, b));
}

/* From the sums down the columns to those of the spot. The patch begins at column `left`. */
static void set_light(struct spot *spot, const struct column_sums *sums, int light_x, int left)
{
	rows2 both = simde_mm256_add_epi64(simde_mm256_unpacklo_epi64(sums->light, sums->light_k),
					   simde_mm256_unpackhi_epi64(sums->light, sums->light_k));
	int64_t light[4], w;

	simde_mm256_storeu_si256((rows2 *)(void *)light, both);
	w = light[0] + light[2];
	spot->w = w;
	spot->wx = light_x + w * (left + MIDDLE_X - spot->x0);
	spot->wy = 2 * (light[1] + light[3] - w) + light[2];
	spot->peak = greatest(simde_mm_max_epu8(simde_mm256_castsi256_si128(sums->peak),
						simde_mm256_extracti128_si256(sums->peak, 1)));
}

/* As spot_area_moments() does from runs; rows are counted from 2 k on. */
static void set_area(struct spot *spot, const struct totals *even, const struct totals *odd)
{
	int n = even->n + odd->n, k = even->k + odd->k, kk = 2 * (even->kk + odd->kk) - k;
	int x = even->x + odd->x, xx = even->xx + odd->xx;
	int y = 2 * k + odd->n, xy = 2 * (even->kx + odd->kx) + odd->x;
	int yy = 4 * (kk + odd->k) + odd->n;
	float scale = 1 / (float)(n * n);

	spot->area_px2 = n;
	spot->area_xx = (float)(n * xx - x * x) * scale + 1 / 12.0f;
	spot->area_xy = (float)(n * xy - x * y) * scale;
	spot->area_yy = (float)(n * yy - y * y) * scale + 1 / 12.0f;
}

void spot_sum_patch(struct spot *spot, const struct patch_copy *copy)
{
	struct column_sums sums;
	struct totals totals[2];

	sum_columns(copy->pixels, (grey)spot->level, &sums);
	find_totals(&sums, totals);
	set_light(spot, &sums, totals[0].light_x + totals[1].light_x, copy->x0);
	set_area(spot, &totals[0], &totals[1]);
}
