/*
 * Passes of assignment: first around each marker's own motion, then around predictions that the
 * neighbours have corrected; a pass more while a fresh start still spreads over the face.
 */
#include "track/label/label.h"

#include <string.h>

#define GATE_SIGMA 3.5
#define GATE_MIN_M 0.0015 /* all the gate for a point whose views hardly agree */
#define GATE_MAX_M 0.015
#define POINTS_PER_LABEL 8
#define SKIP_COST 40.0 /* above any cost inside the gate */
#define PASSES 2
#define PASSES_FRESH 6
#define SIGMA_UNIT_M 0.0005
#define PASSES_FAR 5
#define READ_AGAIN 4
#define TELLS_S 0.1    /* a younger name says nothing of others */
#define GHOST_COST 9.0 /* three sigmas: of a known light rather than a marker */

/* What it costs to be expected so vaguely: the part of the negative log-likelihood (times 2) of any
 * point, up to a constant, that its distance does not change. */
static double cost_of_vague(double sigma_m)
{
	return sigma_m > SIGMA_UNIT_M ? 6 * log(sigma_m / SIGMA_UNIT_M) : 0;
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

/* The points within reach of where a label is expected. */
static int find_edges(const struct labelling *l, struct vec3 expected_m, double sigma_m,
		      double diameter_m, struct assign_edge *edges)
{
	const struct nearby *nearby = &l->nearby;
	double gate_m = fmin(fmax(GATE_SIGMA * sigma_m, GATE_MIN_M), GATE_MAX_M);
	double vague_cost = cost_of_vague(sigma_m);
	int count = 0;

	for (int k = nearby_from(nearby, expected_m.x - gate_m);
	     k < nearby->count && nearby->p_stage_m[k].x <= expected_m.x + gate_m; k++) {
		struct vec3 off = vec3_sub(nearby->p_stage_m[k], expected_m);
		double distance2_m2 = vec3_dot(off, off);

		double reach_m = l->is_strained[nearby->point[k]] ? GATE_MIN_M : gate_m;
		if (distance2_m2 >= reach_m * reach_m ||
		    !point_size_fits(&l->sizes[nearby->point[k]], diameter_m))
			continue;
		double ratio = sqrt(distance2_m2) / sigma_m;
		double ghost_cost = l->is_ghost[nearby->point[k]] ? GHOST_COST : 0;
		count = add_edge(edges, count,
				 (struct assign_edge){nearby->point[k],
						      ratio * ratio + vague_cost + ghost_cost});
	}
	return count;
}

/* Labels whose frame is lost have no edges; nor have those, in the first pass, that only their
 * neighbours can place. */
static void fill_edges(struct labelling *l, const struct tracker_state *state,
		       const struct predictions *predictions, bool first_pass)
{
	struct assign *a = &l->assign;

	a->row_start[0] = 0;
	for (uint32_t i = 0; i < predictions->count; i++) {
		const struct prediction *p = &predictions->labels[i];
		int frame = state->labels[i].frame;

		a->row_start[i + 1] = a->row_start[i];
		if (!l->found[frame])
			continue;
		l->expected_m[i] = pose_apply(&l->rt_stage_frame[frame], p->local_m);
		if (!first_pass || p->recent || predictions->fresh[frame])
			a->row_start[i + 1] +=
				find_edges(l, l->expected_m[i], p->sigma_m,
					   state->labels[i].diameter_m, &a->edges[a->row_start[i]]);
	}
}

/* The pass changed nothing: another would not either. */
static bool answer_stands(const struct labelling *l)
{
	return memcmp(l->point_of_label, l->assign.column_of_row,
		      (size_t)l->assign.row_count * sizeof(l->point_of_label[0])) == 0;
}

static void take_answer(struct labelling *l, const struct tracker_state *state,
			const struct point *points)
{
	for (int r = 0; r < l->assign.row_count; r++) {
		l->point_of_label[r] = l->assign.column_of_row[r];
		l->seen[r] = l->point_of_label[r] != ASSIGN_NONE;
		if (l->seen[r])
			l->seen_m[r] = pose_apply(&l->rt_frame_stage[state->labels[r].frame],
						  points[l->point_of_label[r]].fix.p_stage_m);
	}
}

static bool any_fresh(const struct labelling *l, const struct tracker_state *state)
{
	for (uint32_t f = 0; f < state->frame_count; f++)
		if (l->found[f] && l->motion.fresh[f])
			return true;
	return false;
}

static const bool NOBODY[LABEL_MAX];

static void read_expression(struct labelling *l, const struct tracker_state *state, int actor,
			    int64_t now_ns)
{
	if (l->found[actor])
		expression_solve(state, actor, now_ns, l->tells, l->seen_m, &l->expressions[actor]);
	else
		l->expressions[actor].known = false;
	expression_tell(state, actor, &l->expressions[actor],
			predict_far_apart(state) ? NOBODY : l->tells, l->told);
}

/* What is known of the faces by those of their markers that had their names in the last shot; read
 * again where many more have them, or less. */
static void read_expressions(struct labelling *l, const struct tracker_state *state, int64_t now_ns,
			     bool first)
{
	bool tells[LABEL_MAX];
	int changed[ACTOR_MAX] = {0};

	for (uint32_t i = 0; i < state->label_count; i++) {
		tells[i] = l->seen[i] && l->motion.labels[i].recent &&
			   state->labels[i].seen_ns == state->mid_exposure_ns &&
			   state->labels[i].named_s > TELLS_S;
		changed[state->labels[i].actor] += tells[i] != l->tells[i];
	}
	for (uint32_t a = 0; a < state->actor_count; a++) {
		const struct frame_state *f = &state->frames[a];

		if (!first && !predict_far_apart(state) && changed[a] < READ_AGAIN)
			continue;
		for (int i = f->label_first; i < f->label_end; i++)
			l->tells[i] = tells[i];
		read_expression(l, state, (int)a, now_ns);
	}
}

/* Where no marker's own motion tells which point it is, the face as a whole does. Returns the
 * predictions to begin with. */
static const struct predictions *lay_faces(struct labelling *l, const struct tracker_state *state,
					   int64_t now_ns)
{
	for (uint32_t a = 0; a < state->actor_count; a++)
		l->laid[a].known = false;
	if (!predict_far_apart(state))
		return &l->motion;
	memset(l->told, 0, sizeof(l->told));
	for (uint32_t a = 0; a < state->actor_count; a++) {
		if (!l->found[a] || l->motion.fresh[a])
			continue;
		expression_search(state, (int)a, now_ns, &l->nearby, &l->rt_stage_frame[a],
				  &l->laid[a]);
		if (l->laid[a].known)
			expression_tell(state, (int)a, &l->laid[a].expression, NOBODY, l->told);
	}
	predict_from_face(&l->motion, l->told, &l->predictions);
	return &l->predictions;
}

static void begin_shot(struct labelling *l, const struct tracker_state *state, uint32_t point_count,
		       int64_t now_ns)
{
	l->now_ns = now_ns;
	for (uint32_t f = 0; f < state->frame_count; f++)
		if (l->found[f])
			l->rt_frame_stage[f] = pose_inverse(&l->rt_stage_frame[f]);
	l->assign.row_count = (int)state->label_count;
	l->assign.column_count = (int)point_count;
	l->assign.skip_cost = SKIP_COST;
}

static void assign_points(struct labelling *l, const struct tracker_state *state,
			  const struct point *points, const struct predictions *predictions,
			  bool first_pass)
{
	fill_edges(l, state, predictions, first_pass);
	assign_solve(&l->assign);
	label_put_in_order(l, state, points);
}

void label_points(struct labelling *l, const struct tracker_state *state,
		  const struct point *points, uint32_t point_count, int64_t now_ns)
{
	bool fresh = any_fresh(l, state);
	int passes = fresh ? PASSES_FRESH : predict_far_apart(state) ? PASSES_FAR : PASSES;

	begin_shot(l, state, point_count, now_ns);
	assign_points(l, state, points, lay_faces(l, state, now_ns), true);
	take_answer(l, state, points);
	for (int pass = 0; pass < passes; pass++) {
		read_expressions(l, state, now_ns, pass == 0);
		predict_from_neighbours(state, now_ns, &l->motion, l->seen, l->seen_m, l->told,
					&l->predictions);
		label_expect_in_order(state, &l->predictions);
		assign_points(l, state, points, &l->predictions, false);
		if (!fresh && answer_stands(l))
			break;
		take_answer(l, state, points);
	}
	if (!predict_far_apart(state)) {
		label_pair_left_over(l, state);
		take_answer(l, state, points);
	}
	label_abstain(l, state);
}
