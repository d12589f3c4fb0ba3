/*
 * What the halves of parted spots may show, and how far they are to be believed.
 */
#include <stddef.h>

#include "track/match/match_parts.h"

#define FEW 3         /* views, all of them halves of lips or lids that meet: ... */
#define PLAIN_LEAST 2 /* ... so many must be plain */

bool match_may_show(const struct matcher *m, uint32_t c, int blob, int label)
{
	return !match_is_half(m, c, blob, NULL) || m->part_label[c][blob] == label;
}

bool match_is_half(const struct matcher *m, uint32_t c, int blob, int16_t pair[2])
{
	if (m->cameras[c].blobs != m->parted[c] || m->other_half[c][blob] == BLOB_NONE)
		return false;
	if (!pair)
		return true;
	int16_t one = m->part_label[c][blob], other = m->part_label[c][m->other_half[c][blob]];
	pair[0] = one < other ? one : other;
	pair[1] = one < other ? other : one;
	return true;
}

bool match_is_pressed(const struct matcher *m, const struct point *point)
{
	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		if (!match_is_half(m, c, point->blob[c], NULL) ||
		    m->half_kind[c][point->blob[c]] != HALF_PLAIN)
			return false;
	}
	return true;
}

/* How many there are of the pair that most are of, less those of other pairs. */
static int sure_halves(int16_t (*pairs)[2], int count)
{
	int most = 0;

	for (int i = 0; i < count; i++) {
		int same = 0;

		for (int k = 0; k < count; k++)
			same += pairs[k][0] == pairs[i][0] && pairs[k][1] == pairs[i][1];
		most = same > most ? same : most;
	}
	return 2 * most - count;
}

/* A point's views by what they are. */
struct view_counts {
	int whole, likely, plain;
	int sure_half;
	int16_t pairs[CAMERA_MAX][2]; /* of the sure halves */
};

static void count_half(const struct matcher *m, uint32_t c, int blob, struct view_counts *counts)
{
	enum half kind = m->half_kind[c][blob];

	counts->likely += kind == HALF_LIKELY;
	counts->plain += kind == HALF_PLAIN;
	counts->sure_half += kind != HALF_LONG || m->cameras[c].owner[m->other_half[c][blob]] >= 0;
}

int match_sure_views(const struct matcher *m, const struct point *point)
{
	struct view_counts counts = {.whole = 0};

	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		if (!match_is_half(m, c, point->blob[c], counts.pairs[counts.sure_half]))
			counts.whole++;
		else
			count_half(m, c, point->blob[c], &counts);
	}
	if (counts.whole > 0)
		return counts.whole + counts.sure_half;
	if (point->fix.used_count <= FEW && counts.likely > 0 && counts.plain < PLAIN_LEAST)
		return counts.plain;
	return sure_halves(counts.pairs, counts.sure_half);
}
