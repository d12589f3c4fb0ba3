/*
 * Passes of assignment: first around each marker's own motion, then around predictions that the
 * neighbours have corrected; a pass more while a fresh start still spreads over the face.
 */
#include "track/label.h"

#include <string.h>

#define GATE_SIGMA 3.5
#define GATE_MIN_M 0.0015
#define GATE_MAX_M 0.015
#define POINTS_PER_LABEL 8
#define SKIP_COST 40.0 /* above any cost inside the gate */
#define MARGIN 5.0     /* another reading must be worse by this much, in squared sigmas */
#define PASSES 2
#define PASSES_FRESH 6
#define VAGUE_M 0.002
#define SHARED_M 0.003 /* markers nearer than this may be one spot in every image */
#define ASTRAY_M 0.003
#define SIGMA_UNIT_M 0.0005
#define CLEAR_M 0.0025  /* a new name must lie this near to where the neighbours say ... */
#define REST_SHARE 0.4  /* of the distance to the next marker: so far from rest, and its own way */
#define CLEAR_SHARE 0.3 /* ... or within this share of its distance to the next marker */

/* Negative log-likelihood (times 2) of a point at that distance, up to a constant. */
static double edge_cost(double distance_m, double sigma_m)
{
	double ratio = distance_m / sigma_m;

	return ratio * ratio + 6 * log(fmax(sigma_m / SIGMA_UNIT_M, 1));
}

/* Keeps a label's edges sorted by cost, at most POINTS_PER_LABEL of them. */
static int add_edge(struct assign_edge *edges, int count, struct assign_edge edge)
{
	int place = count;

	while (place > 0 && edges[place - 1].cost > edge.cost)
		place--;
	if (place == POINTS_PER_LABEL)
		return count;
	if (count < POINTS_PER_LABEL)
		count++;
	for (int k = count - 1; k > place; k--)
		edges[k] = edges[k - 1];
	edges[place] = edge;
	return count;
}

static void fill_edges(struct labelling *l, const struct predictions *predictions,
		       uint32_t point_count, bool recent_only)
{
	struct assign *a = &l->assign;

	a->row_count = (int)predictions->count;
	a->column_count = (int)point_count;
	a->skip_cost = SKIP_COST;
	a->row_start[0] = 0;
	for (uint32_t i = 0; i < predictions->count; i++) {
		const struct prediction *p = &predictions->labels[i];
		double gate_m = fmin(fmax(GATE_SIGMA * p->sigma_m, GATE_MIN_M), GATE_MAX_M);
		struct assign_edge *edges = &a->edges[a->row_start[i]];
		int count = 0;

		for (uint32_t k = 0; k < point_count && (p->recent || !recent_only); k++) {
			struct vec3 d = vec3_sub(l->point_local_m[k], p->local_m);

			if (fabs(d.x) > gate_m || fabs(d.y) > gate_m || !l->point_usable[k])
				continue;
			double distance_m = vec3_norm(d);
			if (distance_m < gate_m)
				count = add_edge(
					edges, count,
					(struct assign_edge){(int16_t)k,
							     edge_cost(distance_m, p->sigma_m)});
		}
		a->row_start[i + 1] = a->row_start[i] + count;
	}
}

static double cost_of(const struct assign *a, int row, int column)
{
	for (int e = a->row_start[row]; e < a->row_start[row + 1]; e++)
		if (a->edges[e].column == column)
			return a->edges[e].cost;
	return a->skip_cost;
}

/* How much worse the best other reading is that gives this label another point. */
static double margin_of_moving(const struct labelling *l, int row)
{
	const struct assign *a = &l->assign;
	/* a vague prediction is vague about the face, not about which of two points is nearer */
	double vague = fmax(l->predictions.labels[row].sigma_m / VAGUE_M, 1);
	int column = a->column_of_row[row];
	double own = cost_of(a, row, column), margin = INFINITY;

	for (int e = a->row_start[row]; e < a->row_start[row + 1]; e++) {
		int other_column = a->edges[e].column;
		int other_row = a->row_of_column[other_column];
		double change = a->edges[e].cost - own;

		if (other_column == column)
			continue;
		if (other_row != ASSIGN_NONE)
			change +=
				cost_of(a, other_row, column) - cost_of(a, other_row, other_column);
		margin = fmin(margin, change);
	}
	return margin * vague * vague;
}

/* A label without a point is expected where another has one: the two may have merged into it, or it
 * may be either's. */
static void doubt_shared(struct labelling *l, const struct tracker_state *state, int lonely)
{
	const struct assign *a = &l->assign;

	if (!state->labels[lonely].confirmed)
		return;
	for (int r = 0; r < a->row_count; r++) {
		int column = a->column_of_row[r];

		if (column != ASSIGN_NONE &&
		    vec3_distance(l->point_local_m[column], l->predictions.labels[lonely].local_m) <
			    SHARED_M)
			l->doubtful[r] = l->doubtful[lonely] = true;
	}
}

/* The neighbours tell of a place far from this label's point, and a point that nobody explains lies
 * much nearer to it. */
static bool is_astray(const struct labelling *l, const struct tracker_state *state,
		      const struct layout *layout, int row)
{
	const struct label_state *label = &state->labels[row];
	const struct assign *a = &l->assign;
	struct vec3 moved_m;
	double sigma_m;

	if (layout->markers[row].rigid ||
	    predict_displacement(label, layout, l->seen, l->seen_m, &moved_m, &sigma_m) < 3)
		return false;
	struct vec3 told_m = vec3_add(layout->markers[row].neutral_m, moved_m);
	double off_m = vec3_distance(told_m, l->seen_m[row]);
	if (off_m < ASTRAY_M + 2 * sigma_m)
		return false;
	for (int k = 0; k < a->column_count; k++)
		if (l->point_usable[k] && a->row_of_column[k] == ASSIGN_NONE &&
		    vec3_distance(told_m, l->point_local_m[k]) < 0.5 * off_m)
			return true;
	return false;
}

/* Takes away the names that another label without a point could claim nearly as well, and those
 * that could as well be elsewhere. */
static void abstain(struct labelling *l, const struct tracker_state *state,
		    const struct layout *layout)
{
	struct assign *a = &l->assign;

	memset(l->doubtful, 0, sizeof(l->doubtful));
	for (int r = 0; r < a->row_count; r++) {
		if (a->column_of_row[r] != ASSIGN_NONE) {
			l->doubtful[r] |=
				margin_of_moving(l, r) < MARGIN || is_astray(l, state, layout, r);
			continue;
		}
		doubt_shared(l, state, r);
		for (int e = a->row_start[r]; e < a->row_start[r + 1]; e++) {
			int owner = a->row_of_column[a->edges[e].column];

			if (owner != ASSIGN_NONE &&
			    a->edges[e].cost < cost_of(a, owner, a->edges[e].column) + MARGIN)
				l->doubtful[owner] = true;
		}
	}
	for (int r = 0; r < a->row_count; r++) {
		l->point_of_label[r] = l->doubtful[r] ? ASSIGN_NONE : a->column_of_row[r];
		l->seen[r] = l->point_of_label[r] != ASSIGN_NONE;
	}
}

static void take_answer(struct labelling *l)
{
	for (int r = 0; r < l->assign.row_count; r++) {
		l->point_of_label[r] = l->assign.column_of_row[r];
		l->seen[r] = l->point_of_label[r] != ASSIGN_NONE;
	}
}

/* The pass changed nothing: another would not either. */
static bool answer_stands(const struct labelling *l)
{
	return memcmp(l->point_of_label, l->assign.column_of_row,
		      (size_t)l->assign.row_count * sizeof(l->point_of_label[0])) == 0;
}

static void note_places(struct labelling *l)
{
	for (int r = 0; r < l->assign.row_count; r++)
		if (l->seen[r])
			l->seen_m[r] = l->point_local_m[l->point_of_label[r]];
}

void label_points(struct labelling *l, const struct tracker_state *state,
		  const struct layout *layout, const struct point *points, uint32_t point_count,
		  const struct pose *rt_stage_head, int64_t now_ns)
{
	struct pose rt_head_stage = pose_inverse(rt_stage_head);
	int passes = l->motion.fresh_start ? PASSES_FRESH : PASSES;

	for (uint32_t k = 0; k < point_count; k++) {
		l->point_local_m[k] = pose_apply(&rt_head_stage, points[k].fix.p_stage_m);
		/* three cameras had a say, even if one was outvoted */
		l->point_usable[k] = __builtin_popcount(points[k].claimed_mask) >= 3;
	}
	fill_edges(l, &l->motion, point_count, !l->motion.fresh_start);
	assign_solve(&l->assign);
	take_answer(l);
	note_places(l);
	for (int pass = 0; pass < passes; pass++) {
		predict_from_neighbours(state, layout, now_ns, &l->motion, l->seen, l->seen_m,
					&l->predictions);
		fill_edges(l, &l->predictions, point_count, false);
		assign_solve(&l->assign);
		bool settled = !l->motion.fresh_start && answer_stands(l);
		take_answer(l);
		note_places(l);
		if (settled)
			break;
	}
	abstain(l, state, layout);
	note_places(l);
}

static bool unexplained_nearby(const struct labelling *l, uint32_t point_count, struct vec3 where_m,
			       double reach_m)
{
	for (uint32_t k = 0; k < point_count; k++)
		if (l->point_usable[k] && l->assign.row_of_column[k] == ASSIGN_NONE &&
		    vec3_distance(l->point_local_m[k], where_m) < reach_m)
			return true;
	return false;
}

bool label_is_clear(const struct labelling *l, const struct tracker_state *state,
		    const struct layout *layout, uint32_t point_count, uint32_t label)
{
	const struct label_state *own = &state->labels[label];
	struct vec3 moved_m;
	double sigma_m;

	if (layout->markers[label].rigid)
		return true; /* its gate is tight and the jig is stiff */
	if (predict_displacement(own, layout, l->seen, l->seen_m, &moved_m, &sigma_m) < 2)
		return own->neighbour_count < 2;
	struct vec3 told_m = vec3_add(layout->markers[label].neutral_m, moved_m);
	/* a neighbourhood that is read one marker aside agrees with itself, but not with its rest
	 */
	if (vec3_distance(own->rest_m, l->seen_m[label]) >
	    REST_SHARE * own->spacing_m + sqrt(own->rest_variance_m2))
		return false;
	return vec3_distance(told_m, l->seen_m[label]) <
		       fmin(CLEAR_M, CLEAR_SHARE * own->spacing_m) &&
	       !unexplained_nearby(l, point_count, l->seen_m[label], 1.2 * own->spacing_m);
}
