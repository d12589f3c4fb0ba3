/*
 * The light of a small spot of 8-bit pixels, sixteen at a time: integers, whatever the order.
 */
#include "track/blobs/blobs_parts.h"
#include "track/blobs/blobs_weights.h"

#define SMALL_PX 256 /* spots up to this size are summed in 16 and 32 bits */

/* The first `count` (1 to CHUNK_PX) pixels at (x, y); the rest is zero. */
static vec load_chunk(const struct grey_image *image, int x, int y, int count)
{
	static const uint8_t keep[2 * CHUNK_PX] = {255, 255, 255, 255, 255, 255, 255, 255,
						   255, 255, 255, 255, 255, 255, 255, 255};
	const uint8_t *p = grey_row(image, y) + x;
	vec mask = simde_mm_loadu_si128((const vec *)(keep + CHUNK_PX - count));
	uint8_t spare[CHUNK_PX] = {0};

	if (x + CHUNK_PX > image->width_px) {
		for (int i = 0; i < count; i++)
			spare[i] = p[i];
		p = spare;
	}
	return simde_mm_and_si128(simde_mm_loadu_si128((const vec *)p), mask);
}

bool spot_sum_short(struct spot *spot, const struct run *runs, const struct grey_image *image)
{
	vec zero = simde_mm_setzero_si128(), level = simde_mm_set1_epi8((char)spot->level);
	struct weight_sums sums = {zero, zero, zero, zero};

	if (spot->x1 - spot->x0 > SMALL_PX || spot->y1 - spot->y0 > SMALL_PX)
		return false;
	for (uint32_t r = spot->first_run; r != RUN_NONE; r = runs[r].next)
		for (int x = runs[r].x0; x < runs[r].x1; x += CHUNK_PX) {
			int count = runs[r].x1 - x < CHUNK_PX ? runs[r].x1 - x : CHUNK_PX;
			vec v = load_chunk(image, x, runs[r].y, count);

			sums.peak = simde_mm_max_epu8(sums.peak, v);
			add_chunk(&sums, simde_mm_subs_epu8(v, level), x - spot->x0,
				  runs[r].y - spot->y0);
		}
	spot->w = total(sums.w);
	spot->wx = total(sums.wx);
	spot->wy = total(sums.wy);
	spot->peak = greatest(sums.peak);
	return true;
}
