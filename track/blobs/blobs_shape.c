/*
 * What a spot looks like, from the area above its threshold and the mean height over it.
 */
#include "track/blobs/blobs_sight.h"

#define POINT_VARIANCE_PX2 0.6f /* no spot is sharper than a pixel */
#define SHAPELESS_AREA_PX2 6

/* To seven digits, for 0 < v <= 1; the library's differs between processors. v = m 2^e with m from
 * 3/4 to 3/2; ln m = 2 artanh((m - 1) / (m + 1)). */
static float8 natural_log(float8 v)
{
	simde__m256i bits = simde_mm256_castps_si256(v);
	simde__m256i above = simde_mm256_and_si256(
		simde_mm256_sub_epi32(bits, simde_mm256_set1_epi32(0x3f400000)),
		simde_mm256_set1_epi32((int)0xff800000u));
	float8 m = simde_mm256_castsi256_ps(simde_mm256_sub_epi32(bits, above));
	float8 exponent = simde_mm256_cvtepi32_ps(simde_mm256_srai_epi32(above, 23));
	float8 t = over(sub(m, all(1)), add(m, all(1))), t2 = mul(t, t);
	float8 series = add(all(1 / 7.0f), mul(t2, all(1 / 9.0f)));

	series = add(all(0.2f), mul(t2, series));
	series = add(all(1 / 3.0f), mul(t2, series));
	series = add(all(1), mul(t2, series));
	return add(mul(exponent, all(0.69314718f)), mul(mul(all(2), t), series));
}

/* From the area above the threshold and the mean height over it. A Gaussian cut off low down is a
 * cone with a wide skirt, a disc is the same at every height; between the two the mean height
 * tells. What is cut off is `cut` times the height, at sqrt(2 `depth`) standard deviations. */
struct shapes spot_shapes(const struct sight *sight)
{
	float8 peak = load8(sight->peak), area = load8(sight->area);
	float8 height = sub(peak, load8(sight->level));
	float8 full = sub(peak, load8(sight->background));
	float8 cut = greater(sub(all(1), over(height, full)), all(0.02f));
	float8 depth = sub(all(0), natural_log(cut)), kept = sub(all(1), cut);
	float8 mean_of_gauss = over(sub(kept, mul(cut, depth)), mul(depth, kept));
	float8 fill = over(sub(over(load8(sight->w), mul(area, height)), mean_of_gauss),
			   sub(all(1), mean_of_gauss));
	float8 hollow = sub(all(1), lesser(greater(fill, all(0)), all(1)));
	float8 flatness = sub(all(1), mul(mul(hollow, hollow), root(hollow)));
	float8 few = exceeds(all(SHAPELESS_AREA_PX2), area);
	float8 round = over(area, mul(all(6.2832f), depth)), grow;
	struct shapes out;

	flatness = mul(flatness, lesser(greater(over(sub(area, all(4)), all(16)), all(0)), all(1)));
	grow = mul(all(0.83f), add(over(mul(sub(all(1), flatness), all(2)), depth), flatness));
	out.xx = select8(few, round, mul(load8(sight->area_xx), grow));
	out.yy = select8(few, round, mul(load8(sight->area_yy), grow));
	out.xy = select8(few, all(0), mul(load8(sight->area_xy), grow));
	out.xx = greater(out.xx, all(POINT_VARIANCE_PX2));
	out.yy = greater(out.yy, all(POINT_VARIANCE_PX2));
	out.flatness = flatness;
	return out;
}
