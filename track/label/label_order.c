/*
 * Lips and lids that meet and part: the upper one's marker always lies higher in the head than the
 * one across on the lower. While both are one spot, neither has a name.
 */
#include "track/label/label.h"

#define PRESSED_M 0.003 /* markers nearer than this may be one spot in every image */
#define PRESSED_SIGMA 1.0
#define PRESSED_LAST_M 0.004 /* ... of where the missing one was when it was just seen */
#define JUST_SEEN_S 1.0
#define CROSSED_M 0.001 /* the least height of one over the other, where no diameter tells it */

static double height_m(const struct labelling *l, const struct tracker_state *state,
		       const struct point *points, int row)
{
	const struct vec3 *p_stage_m = &points[l->assign.column_of_row[row]].fix.p_stage_m;

	return pose_apply(&l->rt_frame_stage[state->labels[row].frame], *p_stage_m).y;
}

static void take_away_strained(struct labelling *l, int row)
{
	int16_t point = l->assign.column_of_row[row];

	if (!l->is_strained[point])
		return;
	l->assign.column_of_row[row] = ASSIGN_NONE;
	l->assign.row_of_column[point] = ASSIGN_NONE;
}

void label_put_in_order(struct labelling *l, const struct tracker_state *state,
			const struct point *points)
{
	struct assign *a = &l->assign;

	for (int upper = 0; upper < a->row_count; upper++) {
		int lower = state->labels[upper].below;

		if (lower < 0 || a->column_of_row[upper] == ASSIGN_NONE ||
		    a->column_of_row[lower] == ASSIGN_NONE ||
		    height_m(l, state, points, upper) >= height_m(l, state, points, lower))
			continue;
		int16_t higher = a->column_of_row[lower];

		a->column_of_row[lower] = a->column_of_row[upper];
		a->column_of_row[upper] = higher;
		a->row_of_column[higher] = (int16_t)upper;
		a->row_of_column[a->column_of_row[lower]] = (int16_t)lower;
		take_away_strained(l, upper);
		take_away_strained(l, lower);
	}
}

/* The less sure one gives way. */
static void set_apart(struct prediction *upper, struct prediction *lower, double least_m)
{
	double short_m = least_m - (upper->local_m.y - lower->local_m.y);
	double upper_m2 = upper->sigma_m * upper->sigma_m;
	double both_m2 = upper_m2 + lower->sigma_m * lower->sigma_m;

	if (short_m <= 0 || both_m2 <= 0)
		return;
	upper->local_m.y += short_m * upper_m2 / both_m2;
	lower->local_m.y -= short_m * (1 - upper_m2 / both_m2);
}

void label_expect_in_order(const struct tracker_state *state, struct predictions *predictions)
{
	for (uint32_t upper = 0; upper < state->label_count; upper++) {
		const struct label_state *label = &state->labels[upper];

		if (label->below >= 0)
			set_apart(&predictions->labels[upper], &predictions->labels[label->below],
				  fmax(label->diameter_m, CROSSED_M));
	}
}

bool label_order_tells(const struct tracker_state *state, int row, int other_row)
{
	return other_row != ASSIGN_NONE &&
	       (state->labels[row].below == other_row || state->labels[other_row].below == row);
}

/* The one without a point may be in the other's. */
static bool is_pressed(const struct labelling *l, const struct tracker_state *state, int lonely,
		       int row)
{
	const struct label_state *label = &state->labels[lonely];
	const struct prediction *p = &l->predictions.labels[lonely];
	bool just_seen = (double)(l->now_ns - label->seen_ns) * 1e-9 < JUST_SEEN_S;

	return label->confirmed &&
	       (vec3_distance(p->local_m, l->seen_m[row]) <
			PRESSED_M + PRESSED_SIGMA * p->sigma_m ||
		(just_seen && vec3_distance(label->local_m, l->seen_m[row]) < PRESSED_LAST_M));
}

/* Two cameras alone see the other, where it should be. */
static bool are_apart(const struct labelling *l, int upper, int lower)
{
	return l->point_of_label[upper] != ASSIGN_NONE && l->point_of_label[lower] != ASSIGN_NONE &&
	       l->seen_m[upper].y > l->seen_m[lower].y;
}

void label_doubt_pressed(struct labelling *l, const struct tracker_state *state)
{
	const struct assign *a = &l->assign;

	for (int upper = 0; upper < a->row_count; upper++) {
		int lower = state->labels[upper].below;

		if (lower < 0 ||
		    (a->column_of_row[upper] == ASSIGN_NONE) ==
			    (a->column_of_row[lower] == ASSIGN_NONE) ||
		    are_apart(l, upper, lower))
			continue;
		bool has_upper = a->column_of_row[upper] != ASSIGN_NONE;
		int lonely = has_upper ? lower : upper, row = has_upper ? upper : lower;

		if (is_pressed(l, state, lonely, row))
			l->doubtful[upper] = l->doubtful[lower] = true;
	}
}
