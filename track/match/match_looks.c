/*
 * How the named markers look to each camera that sees them alone, so that it is known what is left
 * when two are one spot.
 */
#include "track/match/match_parts.h"

#define BOTH_SPREADS2 6.0 /* squared spreads: so near, another may be in a spot */
#define SHAPE_GAIN 0.3f   /* of what is new, as one shot's is noisy and discs turn */
#define SEES_GAIN 0.1f

/* Whether an upper lip's or lid's spot may be the lower one's too, for which the camera has no
 * other. Lower ones are learned even then: to spare them as well was tried and made no difference.
 */
static bool may_be_both(const struct matcher *m, uint32_t c, const struct blob *blob,
			const struct label_state *label, const int16_t *point_of_label)
{
	int across = label->below;
	int seed = across == LABEL_NONE ? -1 : m->seed_of_label[across];
	int point = across == LABEL_NONE ? -1 : point_of_label[across];

	if (seed < 0 || (point >= 0 && m->points[point].claimed_mask >> c & 1))
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

static void learn_look(const struct matcher *m, const struct point *point,
		       const int16_t *point_of_label, const struct label_state *label,
		       struct label_look *look)
{
	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		const struct blob *blob = &m->cameras[c].blobs[point->blob[c]];

		if (blob->flags & (BLOB_MERGED | BLOB_EDGE) || !(blob->shape_px2[0] > 0) ||
		    may_be_both(m, c, blob, label, point_of_label))
			continue;
		learn_shape(blob, look->shape_px2[c]);
		if (!merged_is_long(blob))
			look->peak[c] = (uint8_t)(blob->peak < UINT8_MAX ? blob->peak : UINT8_MAX);
	}
}

/* A camera that sent nothing says nothing. */
static void learn_who_sees(const struct matcher *m, const struct point *point,
			   struct label_look *look)
{
	for (uint32_t c = 0; c < m->camera_count; c++)
		if (m->cameras[c].view)
			look->sees[c] +=
				SEES_GAIN * ((float)(point->claimed_mask >> c & 1) - look->sees[c]);
}

/* Where nothing was expected, no spot was parted that is two. */
void match_learn_looks(const struct matcher *m, struct tracker_state *state)
{
	int16_t point_of_label[LABEL_MAX];

	for (uint32_t i = 0; i < state->label_count; i++)
		point_of_label[i] = -1;
	for (uint32_t p = 0; p < m->point_count; p++)
		if (m->points[p].label != LABEL_NONE)
			point_of_label[m->points[p].label] = (int16_t)p;
	for (uint32_t i = 0; i < state->label_count; i++) {
		if (point_of_label[i] < 0 || m->seed_of_label[i] < 0)
			continue;
		const struct point *point = &m->points[point_of_label[i]];

		learn_look(m, point, point_of_label, &state->labels[i], &state->looks[i]);
		learn_who_sees(m, point, &state->looks[i]);
	}
}
