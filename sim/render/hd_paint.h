/*
 * A painted head for HD pictures: skin with blotches, freckles and pores, eyes, lips, brows, hair.
 * Lids close and lips part when it is looked at, so that the paint itself never changes.
 */
#pragma once

#include <stdint.h>

#define HD_PAINT_SIDE 384 /* texels each way, of the face */
#define HD_BACK_SIDE 128  /* of the hair behind */

enum hd_colour { HD_RED, HD_GREEN, HD_BLUE, HD_COLOURS };

/* What has to be looked at twice. */
enum hd_part { HD_STILL, HD_EYE_L, HD_EYE_R, HD_MOUTH };

/* On the unit sphere that the skull is a stretched one of, seen along the head's z axis, lit from
 * above: red, green, blue, enum hd_part. Flat; read by any thread once made. */
struct hd_paint {
	uint8_t face[HD_PAINT_SIDE][HD_PAINT_SIDE][4];
	uint8_t back[HD_BACK_SIDE][HD_BACK_SIDE][4];
	uint8_t lid[4];
};

/* Colours and all that is random vary with the seed. */
void hd_paint_init(struct hd_paint *paint, uint64_t seed);

struct hd_mood {
	float gap;     /* between the lips, of the skull's half height */
	float lids[2]; /* 0 open to 1 closed; left, right */
};

/* What a lid or parted lips show in place of `texel`. */
const uint8_t *hd_paint_live(const struct hd_paint *paint, const struct hd_mood *mood,
			     const uint8_t *texel, float x, float y);

/* `s` within +-1.008: what rounding makes of the unit sphere. */
static inline int hd_texel_index(float s, int side)
{
	return (int)((s + 1.008f) * (0.496f * (float)side));
}

static inline const uint8_t *hd_paint_behind(const struct hd_paint *paint, float x, float y)
{
	return paint->back[hd_texel_index(y, HD_BACK_SIDE)][hd_texel_index(x, HD_BACK_SIDE)];
}
