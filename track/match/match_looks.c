/*
 * How the named markers look to each camera that sees them alone, so that it is known what is left
 * when two are one spot.
 */
#include "track/match/match_parts.h"

#define BOTH_SPREADS2 6.0 /* squared spreads: so near, another may be in a spot */
#define SHAPE_GAIN 0.3f   /* of what is new, as one shot's is noisy and discs turn */
#define SEES_GAIN 0.1f

/* Whether the spot may be its own and that of the marker across the lips or lids, which has no
 * point. */
static bool may_be_both(const struct matcher *m, uint32_t c, const struct blob *blob,
			const struct label_state *label, const bool *has_point)
{
	int across = label->below != LABEL_NONE ? label->below : label->above;
	int seed = across == LABEL_NONE || has_point[across] ? -1 : m->seed_of_label[across];

	if (seed < 0)
		return false;
	double x_px = m->seen[c][seed].pixel[0] - blob->x_px;
	double y_px = m->seen[c][seed].pixel[1] - blob->y_px;
	double spread_px2 = (double)(blob->shape_px2[0] + blob->shape_px2[2]);
	return x_px * x_px + y_px * y_px < BOTH_SPREADS2 * spread_px2;
}

static void learn_shape(const struct blob *blob, float known_px2[3])
{
	float gain = known_px2[0] > 0 ? SHAPE_GAIN : 1;

	for (int k = 0; k < 3; k++)
		known_px2[k] += gain * (blob->shape_px2[k] - known_px2[k]);
}

static void learn_look(const struct matcher *m, const struct point *point, const bool *has_point,
		       const struct label_state *label, struct label_look *look)
{
	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		const struct blob *blob = &m->cameras[c].blobs[point->blob[c]];

		if (blob->flags & (BLOB_MERGED | BLOB_EDGE) || !(blob->shape_px2[0] > 0) ||
		    may_be_both(m, c, blob, label, has_point))
			continue;
		learn_shape(blob, look->shape_px2[c]);
		if (!merged_is_long(blob))
			look->peak[c] = (uint8_t)(blob->peak < UINT8_MAX ? blob->peak : UINT8_MAX);
	}
}

static void learn_who_sees(const struct matcher *m, const struct point *point,
			   struct label_look *look)
{
	for (uint32_t c = 0; c < m->camera_count; c++) {
		float sees = (float)(point->claimed_mask >> c & 1);

		look->sees[c] += SEES_GAIN * (sees - look->sees[c]);
	}
}

void match_learn_looks(const struct matcher *m, struct tracker_state *state)
{
	bool has_point[LABEL_MAX] = {false};

	for (uint32_t p = 0; p < m->point_count; p++)
		if (m->points[p].label != LABEL_NONE)
			has_point[m->points[p].label] = true;
	for (uint32_t p = 0; p < m->point_count; p++) {
		const struct point *point = &m->points[p];

		if (point->label == LABEL_NONE)
			continue;
		learn_look(m, point, has_point, &state->labels[point->label],
			   &state->looks[point->label]);
		learn_who_sees(m, point, &state->looks[point->label]);
	}
}
