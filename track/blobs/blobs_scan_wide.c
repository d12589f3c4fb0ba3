/*
 * The detection scan with vectors of 32 bytes, for processors that have them (AVX2): the same bits
 * in half the instructions, so that more of the other work fits into the waits for memory.
 */
#include <simde/x86/avx2.h>

#include "track/blobs/blobs_parts.h"

typedef simde__m256i bytes32;

static bytes32 load(const uint8_t *p)
{
	return simde_mm256_loadu_si256((const bytes32 *)p);
}

/* Nonzero bytes where a column of the group's two halves holds a pixel above its level. */
static bytes32 over_level(const uint8_t *p, const uint8_t *level)
{
	simde__m128i once = simde_mm_loadu_si128((const simde__m128i *)level);

	return simde_mm256_subs_epu8(simde_mm256_max_epu8(load(p), load(p + 32)),
				     simde_mm256_broadcastsi128_si256(once));
}

/* Written down and, where dark, overwritten by the next: no branch to guess wrong. */
static inline size_t note(bytes32 over, int y, int group, struct candidate *out)
{
	*out = (struct candidate){(uint16_t)y, (uint16_t)group};
	return !simde_mm256_testz_si256(over, over);
}

size_t blob_scan(const uint8_t *row, int y, const uint8_t *levels, int group_count,
		 struct candidate *out)
{
	size_t count = 0;
	int g = 0;

	for (; g + 4 <= group_count; g += 4) {
		const uint8_t *p = row + (size_t)g * GROUP_PX;
		const uint8_t *level = levels + (size_t)g * CELL_PX;
		bytes32 a = over_level(p, level);
		bytes32 b = over_level(p + GROUP_PX, level + CELL_PX);
		bytes32 c = over_level(p + 2 * GROUP_PX, level + 2 * CELL_PX);
		bytes32 d = over_level(p + 3 * GROUP_PX, level + 3 * CELL_PX);
		bytes32 over = simde_mm256_or_si256(simde_mm256_or_si256(a, b),
						    simde_mm256_or_si256(c, d));

		scan_expect(p, 4);
		if (simde_mm256_testz_si256(over, over))
			continue;
		count += note(a, y, g, out + count);
		count += note(b, y, g + 1, out + count);
		count += note(c, y, g + 2, out + count);
		count += note(d, y, g + 3, out + count);
	}
	for (; g < group_count; g++)
		count += note(over_level(row + (size_t)g * GROUP_PX, levels + (size_t)g * CELL_PX),
			      y, g, out + count);
	return count;
}

/* Bit b: v[b] > level[b]. */
static uint64_t bright32(bytes32 v, const uint8_t *level)
{
	bytes32 over = simde_mm256_subs_epu8(v, load(level));
	bytes32 dark = simde_mm256_cmpeq_epi8(over, simde_mm256_setzero_si256());

	return (uint32_t)~simde_mm256_movemask_epi8(dark);
}

uint64_t blob_mask(const uint8_t *p, const uint8_t *level)
{
	return bright32(load(p), level) | bright32(load(p + 32), level + 32) << 32;
}

uint64_t blob_mask_rows(const uint8_t *p, ptrdiff_t stride_bytes, int row_count,
			const uint8_t *level)
{
	bytes32 left = load(p), right = load(p + 32);

	while (--row_count > 0) {
		p += stride_bytes;
		left = simde_mm256_max_epu8(left, load(p));
		right = simde_mm256_max_epu8(right, load(p + 32));
	}
	return bright32(left, level) | bright32(right, level + 32) << 32;
}
