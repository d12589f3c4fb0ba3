/*
 * The detection scan of 16-bit pixels; see blobs_scan.c.
 */
#include <simde/x86/avx2.h>

#include "track/blobs/blobs_parts.h"

#define STEP_PX 16

typedef simde__m256i words; /* sixteen of 16 bits */

static words load(const grey *p)
{
	return simde_mm256_loadu_si256((const words *)(const void *)p);
}

/* Nonzero words where a column of the group's four quarters holds a pixel above its level. */
static words over_level(const grey *p, const grey *level)
{
	words a = simde_mm256_max_epu16(load(p), load(p + STEP_PX));
	words b = simde_mm256_max_epu16(load(p + 2 * STEP_PX), load(p + 3 * STEP_PX));

	return simde_mm256_subs_epu16(simde_mm256_max_epu16(a, b), load(level));
}

static bool is_dark(words over)
{
	words dark = simde_mm256_cmpeq_epi16(over, simde_mm256_setzero_si256());

	return simde_mm256_movemask_epi8(dark) == -1;
}

size_t blob_scan(const grey *row, int y, const grey *levels, int group_count, struct candidate *out)
{
	size_t count = 0;

	for (int g = 0; g < group_count; g++) {
		words over = over_level(row + (size_t)g * GROUP_PX, levels + (size_t)g * CELL_PX);

		scan_expect(row + (size_t)g * GROUP_PX, 1);
		out[count] = (struct candidate){(uint16_t)y, (uint16_t)g};
		count += !is_dark(over);
	}
	return count;
}

/* Bit b: p[b] > level[b]. */
static uint64_t bright16(const grey *p, const grey *level)
{
	words over = simde_mm256_subs_epu16(load(p), load(level));
	words dark = simde_mm256_cmpeq_epi16(over, simde_mm256_setzero_si256());
	simde__m128i bytes = simde_mm_packs_epi16(simde_mm256_castsi256_si128(dark),
						  simde_mm256_extracti128_si256(dark, 1));

	return (uint16_t)~simde_mm_movemask_epi8(bytes);
}

uint64_t blob_mask(const grey *p, const grey *level)
{
	uint64_t mask = 0;

	for (int i = 0; i < GROUP_PX; i += STEP_PX)
		mask |= bright16(p + i, level + i) << i;
	return mask;
}

uint64_t blob_mask_rows(const grey *p, ptrdiff_t stride_bytes, int row_count, const grey *level)
{
	uint64_t mask = 0;

	for (; row_count > 0; row_count--, p += stride_bytes / (ptrdiff_t)sizeof(*p))
		mask |= blob_mask(p, level);
	return mask;
}
