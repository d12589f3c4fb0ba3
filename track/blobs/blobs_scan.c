/*
 * The detection scan: finds the groups of 64 pixels that may hold something bright.
 * Almost every group is dark, so the dark answer must cost no more than reading the pixels.
 */
#include <simde/x86/sse2.h>

#include "track/blobs/blobs_parts.h"

static simde__m128i load(const uint8_t *p)
{
	return simde_mm_loadu_si128((const simde__m128i *)p);
}

/* Nonzero bytes where a column of the group's four quarters holds a pixel above its level. */
static simde__m128i over_level(const uint8_t *p, const uint8_t *level)
{
	simde__m128i a = simde_mm_max_epu8(load(p), load(p + 16));
	simde__m128i b = simde_mm_max_epu8(load(p + 32), load(p + 48));

	return simde_mm_subs_epu8(simde_mm_max_epu8(a, b), load(level));
}

static bool is_dark(simde__m128i over)
{
	simde__m128i dark = simde_mm_cmpeq_epi8(over, simde_mm_setzero_si128());

	return simde_mm_movemask_epi8(dark) == 0xffff;
}

/* Groups [g, end). Each is written down and, where dark, overwritten by the next: no branch to
 * guess wrong. */
static size_t look(const uint8_t *row, int y, const uint8_t *levels, int g, int end,
		   struct candidate *out)
{
	size_t count = 0;

	for (; g < end; g++) {
		out[count] = (struct candidate){(uint16_t)y, (uint16_t)g};
		count += !is_dark(
			over_level(row + (size_t)g * GROUP_PX, levels + (size_t)g * CELL_PX));
	}
	return count;
}

size_t blob_scan(const uint8_t *row, int y, const uint8_t *levels, int group_count,
		 struct candidate *out)
{
	size_t count = 0;
	int g = 0;

	for (; g + 4 <= group_count; g += 4) {
		const uint8_t *p = row + (size_t)g * GROUP_PX;
		const uint8_t *level = levels + (size_t)g * CELL_PX;
		simde__m128i a = simde_mm_or_si128(over_level(p, level),
						   over_level(p + GROUP_PX, level + CELL_PX));
		simde__m128i b =
			simde_mm_or_si128(over_level(p + 2 * GROUP_PX, level + 2 * CELL_PX),
					  over_level(p + 3 * GROUP_PX, level + 3 * CELL_PX));

		scan_expect(p, 4);
		if (!is_dark(simde_mm_or_si128(a, b)))
			count += look(row, y, levels, g, g + 4, out + count);
	}
	return count + look(row, y, levels, g, group_count, out + count);
}

/* Bit b: p[b] > level[b]. */
static uint64_t bright16(const uint8_t *p, const uint8_t *level)
{
	simde__m128i over = simde_mm_subs_epu8(load(p), load(level));

	return (uint16_t)~simde_mm_movemask_epi8(
		simde_mm_cmpeq_epi8(over, simde_mm_setzero_si128()));
}

uint64_t blob_mask(const uint8_t *p, const uint8_t *level)
{
	return bright16(p, level) | bright16(p + 16, level + 16) << 16 |
	       bright16(p + 32, level + 32) << 32 | bright16(p + 48, level + 48) << 48;
}

uint64_t blob_mask_rows(const uint8_t *p, ptrdiff_t stride_bytes, int row_count,
			const uint8_t *level)
{
	uint64_t mask = 0;

	for (; row_count > 0; row_count--, p += stride_bytes)
		mask |= blob_mask(p, level);
	return mask;
}
