/*
 * The detection scan: finds the groups of 64 pixels that hold anything above the threshold.
 * Almost every group is dark, so the dark answer must cost no more than reading the pixels.
 */
#include <simde/x86/sse2.h>

#include "track/blobs_parts.h"

static simde__m128i load(const uint8_t *p)
{
	return simde_mm_loadu_si128((const simde__m128i *)p);
}

/* Bit b: p[b] > level[b]. */
static uint64_t bright16(const uint8_t *p, const uint8_t *level)
{
	simde__m128i over = simde_mm_subs_epu8(load(p), load(level));
	simde__m128i dark = simde_mm_cmpeq_epi8(over, simde_mm_setzero_si128());

	return (uint16_t)~simde_mm_movemask_epi8(dark);
}

static uint64_t bright64(const uint8_t *p, const uint8_t *level)
{
	return bright16(p, level) | bright16(p + 16, level + 16) << 16 |
	       bright16(p + 32, level + 32) << 32 | bright16(p + 48, level + 48) << 48;
}

int blob_scan_simd(const uint8_t *row, const uint8_t *cells, const uint8_t *groups, int group_count,
		   struct bright_group *out)
{
	simde__m128i zero = simde_mm_setzero_si128();
	int count = 0;

	for (int g = 0; g < group_count; g++, row += GROUP_PX) {
		simde__m128i a = simde_mm_max_epu8(load(row), load(row + 16));
		simde__m128i b = simde_mm_max_epu8(load(row + 32), load(row + 48));
		simde__m128i over = simde_mm_subs_epu8(simde_mm_max_epu8(a, b),
						       load(groups + (size_t)g * CELL_PX));

		if (simde_mm_movemask_epi8(simde_mm_cmpeq_epi8(over, zero)) == 0xffff)
			continue;
		out[count].group = (uint32_t)g;
		out[count].mask = bright64(row, cells + (size_t)g * GROUP_PX);
		count += out[count].mask != 0;
	}
	return count;
}

int blob_scan_plain(const uint8_t *row, const uint8_t *cells, const uint8_t *groups,
		    int group_count, struct bright_group *out)
{
	int count = 0;

	(void)groups;
	for (int g = 0; g < group_count; g++) {
		uint64_t mask = 0;

		for (int b = 0; b < GROUP_PX; b++)
			mask |= (uint64_t)(row[g * GROUP_PX + b] > cells[g * GROUP_PX + b]) << b;
		out[count].group = (uint32_t)g;
		out[count].mask = mask;
		count += mask != 0;
	}
	return count;
}
