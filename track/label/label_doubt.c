/*
 * When a name is not sure: another reading is nearly as good, the neighbours tell otherwise, or two
 * markers may have merged into one point.
 */
#include <string.h>

#include "track/label/label.h"

#define MARGIN 5.0 /* another reading must be worse by this much, in squared sigmas */
#define VAGUE_M 0.002
#define SHARED_M 0.003 /* markers nearer than this may be one spot in every image */
#define ASTRAY_M 0.003
#define BETWEEN_M 0.001
#define CLEAR_M 0.0025   /* before they hold names, also within this */
#define REST_SHARE 0.4   /* of the distance to the next marker: so far from rest, and its own way */
#define CLEAR_SHARE 0.3  /* ... so near to where the neighbours say lies a new name */
#define SURE_SIGMA 2.5   /* from there to the next marker */
#define TOLD_MARGIN 12.0 /* the whole face tells a name: in squared sigmas */
#define TOLD_SIGMA 3.5
#define TOLD_SHARE 0.12   /* of the distance to the next marker */
#define PLAIN_MARGIN 20.0 /* no other point could be meant, nor this by another */
#define PLAIN_SHARE 0.35  /* of the distance to the next marker */
#define PLAIN_MAX_M 0.005
#define RIVAL_M 0.001
#define HELD_OFF_M 0.0015 /* of three markers of a segment, from where it has them */
#define HOLDING_MIN 3
#define HINT_SHARE 1.2 /* a point that nobody explains tells of a shift when this near */

static double cost_of(const struct assign *a, int row, int column)
{
	for (int e = a->row_start[row]; e < a->row_start[row + 1]; e++)
		if (a->edges[e].column == column)
			return a->edges[e].cost;
	return a->skip_cost;
}

/* How much worse the best other reading is that gives this label another point. */
static double margin_of_moving(const struct labelling *l, const struct tracker_state *state,
			       int row)
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

		if (other_column == column || label_order_tells(state, row, other_row))
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
	const struct nearby *n = &l->nearby;
	struct vec3 where_m = l->expected_m[lonely];

	if (!state->labels[lonely].confirmed || !l->found[state->labels[lonely].frame])
		return;
	for (int k = nearby_from(n, where_m.x - SHARED_M);
	     k < n->count && n->p_stage_m[k].x <= where_m.x + SHARED_M; k++) {
		int row = l->assign.row_of_column[n->point[k]];

		if (row != ASSIGN_NONE && vec3_distance(n->p_stage_m[k], where_m) < SHARED_M)
			l->doubtful[row] = l->doubtful[lonely] = true;
	}
}

static bool is_unexplained(const struct labelling *l, int point)
{
	return l->assign.row_of_column[point] == ASSIGN_NONE && !l->is_ghost[point];
}

static bool any_unexplained(const struct labelling *l)
{
	for (int k = 0; k < l->nearby.count; k++)
		if (is_unexplained(l, l->nearby.point[k]))
			return true;
	return false;
}

static bool unexplained_near(const struct labelling *l, const struct tracker_state *state,
			     uint32_t label, struct vec3 local_m, double reach_m)
{
	const struct nearby *n = &l->nearby;
	struct vec3 where_m = pose_apply(&l->rt_stage_frame[state->labels[label].frame], local_m);

	for (int k = nearby_from(n, where_m.x - reach_m);
	     k < n->count && n->p_stage_m[k].x <= where_m.x + reach_m; k++)
		if (is_unexplained(l, n->point[k]) &&
		    point_size_fits(&l->sizes[n->point[k]], state->labels[label].diameter_m) &&
		    vec3_distance(n->p_stage_m[k], where_m) < reach_m)
			return true;
	return false;
}

/* The neighbours tell of a place far from this label's point, and a point that nobody explains lies
 * much nearer to it. */
static bool is_astray(const struct labelling *l, const struct tracker_state *state, int row)
{
	const struct label_state *label = &state->labels[row];
	struct vec3 told_m;
	double sigma_m;

	if (label->kind != LABEL_SKIN ||
	    predict_told(state, label, l->seen, l->seen_m, &told_m, &sigma_m) < 3)
		return false;
	double off_m = vec3_distance(told_m, l->seen_m[row]);

	return off_m >= ASTRAY_M + 2 * sigma_m &&
	       unexplained_near(l, state, (uint32_t)row, told_m, 0.5 * off_m);
}

/* What most cameras see as two markers in one lies between the two, if it does not lie where this
 * one was expected. */
static bool is_between(const struct labelling *l, int row)
{
	const struct prediction *p = &l->predictions.labels[row];

	return l->merged[l->assign.column_of_row[row]] &&
	       (!p->recent || vec3_distance(p->local_m, l->seen_m[row]) > BETWEEN_M);
}

/* The points that a label without one could claim nearly as well as their owners. */
static void doubt_claimed(struct labelling *l, int lonely)
{
	const struct assign *a = &l->assign;

	for (int e = a->row_start[lonely]; e < a->row_start[lonely + 1]; e++) {
		int owner = a->row_of_column[a->edges[e].column];

		if (owner == ASSIGN_NONE)
			continue;
		double margin = a->edges[e].cost - cost_of(a, owner, a->edges[e].column);
		l->margin[owner] = fminf(l->margin[owner], (float)margin);
		l->doubtful[owner] |= margin < MARGIN;
	}
}

bool label_is_laid_elsewhere(const struct labelling *l, const struct tracker_state *state,
			     int label)
{
	const struct expression_search *laid = &l->laid[state->labels[label].actor];

	return laid->known && state->labels[label].kind == LABEL_SKIN &&
	       laid->point_of_label[label] != l->assign.column_of_row[label];
}

void label_abstain(struct labelling *l, const struct tracker_state *state)
{
	const struct assign *a = &l->assign;
	bool may_be_astray = any_unexplained(l);

	memset(l->doubtful, 0, sizeof(l->doubtful));
	for (int r = 0; r < a->row_count; r++) {
		l->margin[r] = 0;
		if (a->column_of_row[r] == ASSIGN_NONE)
			continue;
		l->margin[r] = (float)margin_of_moving(l, state, r);
		l->doubtful[r] = l->margin[r] < MARGIN ||
				 (may_be_astray && is_astray(l, state, r)) || is_between(l, r) ||
				 label_is_laid_elsewhere(l, state, r);
	}
	for (int r = 0; r < a->row_count; r++) {
		l->point_of_label[r] = l->doubtful[r] ? ASSIGN_NONE : a->column_of_row[r];
		l->seen[r] = l->point_of_label[r] != ASSIGN_NONE;
	}
}

void label_doubt_lonely(struct labelling *l, const struct tracker_state *state)
{
	const struct assign *a = &l->assign;

	for (int r = 0; r < a->row_count; r++) {
		if (a->column_of_row[r] != ASSIGN_NONE || l->point_of_label[r] != ASSIGN_NONE)
			continue;
		doubt_shared(l, state, r);
		doubt_claimed(l, r);
	}
	label_doubt_pressed(l, state);
	for (int r = 0; r < a->row_count; r++)
		if (l->doubtful[r]) {
			l->point_of_label[r] = ASSIGN_NONE;
			l->seen[r] = false;
		}
}

/* Two others of the segment were there a moment ago and still are, and the three lie as they
 * should: the third is where they say. Of a segment just found, four agree on one place; three may
 * do so by chance. */
static bool is_held(const struct labelling *l, const struct tracker_state *state, uint32_t label)
{
	int16_t frame = state->labels[label].frame;
	const struct frame_state *f = &state->frames[frame];
	bool fresh = l->motion.fresh[frame];
	double off_m = vec3_distance(state->labels[label].base_m, l->seen_m[label]);
	int others = 0;

	for (uint32_t i = f->label_first; i < f->label_end; i++) {
		const struct label_state *other = &state->labels[i];

		if (i == label || other->frame != frame || !l->seen[i] ||
		    !(fresh || l->motion.labels[i].recent))
			continue;
		off_m = fmax(off_m, vec3_distance(other->base_m, l->seen_m[i]));
		others++;
	}
	return fresh ? others >= 3 : others >= 3 || (others == 2 && off_m < HELD_OFF_M);
}

/* Enough of those that tell have held their names for a while: they are not read one aside. */
static bool neighbours_hold(const struct labelling *l, const struct tracker_state *state,
			    const struct label_state *label)
{
	int holding = 0;

	for (int k = 0; k < label->neighbour_count; k++)
		holding += label_holds_name(l, state, label->neighbours[k].label);
	return holding >= HOLDING_MIN;
}

bool label_has_rival(const struct labelling *l, const struct tracker_state *state, uint32_t label)
{
	const struct frame_state *f = &state->frames[state->labels[label].frame];
	struct vec3 seen_m = l->seen_m[label];

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct prediction *p = &l->predictions.labels[i];

		if (l->assign.column_of_row[i] == ASSIGN_NONE &&
		    state->labels[i].kind == LABEL_SKIN &&
		    vec3_distance(p->local_m, seen_m) < RIVAL_M + TOLD_SIGMA * p->sigma_m)
			return true;
	}
	return false;
}

bool label_is_told(const struct labelling *l, const struct tracker_state *state, uint32_t label)
{
	const struct label_state *own = &state->labels[label];
	const struct told *told = &l->told[label];

	if (own->kind != LABEL_SKIN || !told->known || l->margin[label] < TOLD_MARGIN ||
	    !expression_is_learned(state, own->actor))
		return false;
	double off_m = vec3_distance(told->local_m, l->seen_m[label]);
	return off_m < TOLD_SIGMA * told->sigma_m && off_m < TOLD_SHARE * own->spacing_m &&
	       own->spacing_m - off_m > SURE_SIGMA * told->sigma_m &&
	       !label_has_rival(l, state, label);
}

bool label_is_alone(const struct labelling *l, const struct tracker_state *state, uint32_t label)
{
	const struct label_state *own = &state->labels[label];

	return own->kind != LABEL_SKIN ||
	       !unexplained_near(l, state, label, l->seen_m[label], HINT_SHARE * own->spacing_m);
}

bool label_is_plain(const struct labelling *l, const struct tracker_state *state, uint32_t label)
{
	return l->margin[label] >= PLAIN_MARGIN &&
	       vec3_distance(l->predictions.labels[label].local_m, l->seen_m[label]) <
		       fmin(PLAIN_SHARE * state->labels[label].spacing_m, PLAIN_MAX_M);
}

bool label_is_clear(const struct labelling *l, const struct tracker_state *state, uint32_t label)
{
	const struct label_state *own = &state->labels[label];
	struct vec3 told_m, seen_m = l->seen_m[label];
	double sigma_m;

	if (own->kind == LABEL_SKULL)
		return true; /* its gate is tight and the jig is stiff */
	if (own->kind == LABEL_BODY)
		return is_held(l, state, label);
	if (predict_told(state, own, l->seen, l->seen_m, &told_m, &sigma_m) < 2)
		return own->neighbour_count < 2;
	double off_m = vec3_distance(told_m, seen_m);
	if (off_m > CLEAR_SHARE * own->spacing_m || own->spacing_m - off_m < SURE_SIGMA * sigma_m)
		return false;
	/* a neighbourhood that is read one marker aside agrees with itself, but not with its rest
	 */
	return neighbours_hold(l, state, own) ||
	       (off_m <= CLEAR_M &&
		vec3_distance(vec3_add(own->rest_m, own->lean_m), seen_m) <=
			REST_SHARE * own->spacing_m + sqrt(own->rest_variance_m2));
}
