/*
 * A scan over what moves skin farthest, the jaw mostly; from its best places rounds of pairing
 * markers with points and solving for what the face does (Besl and McKay 1992, with patterns in
 * place of a pose).
 */
#include "track/label/expression_search.h"

#include <math.h>
#include <string.h>

#include "track/label/expression_parts.h"

#define SCAN_MM 4.0f        /* of the marker that moves most, from one place to the next */
#define SCAN_REACH_MM 44.0f /* about the last place */
#define SCAN_COUNT (2 * (int)(SCAN_REACH_MM / SCAN_MM) + 1)
#define MOVES_MM 1.0f     /* a pattern that moves no marker as far is not worth a scan */
#define MOVES_SHARE 0.25f /* of what moves most: who moves less is not asked */
#define SEEN_S 0.5        /* ... nor who was hidden for longer */
#define SCAN_STARTS 2
#define READINGS_MAX 6
#define ROUNDS 4
#define REACH_M 0.008
#define SCALE_MIN_MM 0.6f
#define SCALE_MAX_MM 2.5f
#define LOST_COST 16.0   /* of a marker without a point */
#define PAIR_WORTH 32.0  /* neither a marker without a point nor a point without a marker */
#define SAME_M 0.002     /* readings that lay no marker farther apart are one */
#define APART_MARGIN 3.0 /* a rival is worse by so much for each marker that it reads otherwise */

struct search {
	const struct tracker_state *state;
	int actor, first, end; /* its labels lie in here */
	int64_t now_ns;
	const struct nearby *nearby;
	const struct pose *rt_stage_head;
};

/* One way to lay the face on the points. */
struct reading {
	struct expression expression;
	int16_t entry_of_label[LABEL_MAX]; /* of the nearby points, or -1 */
	double distance2_m2[LABEL_MAX];    /* valid where there is one */
	double cost;                       /* negative log-likelihood, times 2, up to a constant */
};

static bool is_asked(const struct search *s, int i)
{
	return is_skin(s->state, i, s->actor);
}

static struct vec3 place_m(const struct search *s, int i, const float *amount)
{
	float off[3], none[3] = {0};

	row_off_mm(&s->state->rows[i], amount, s->state->expressions[s->actor].count, none, off);
	struct vec3 shift_m = vec3_scale((struct vec3){off[0], off[1], off[2]}, -MM);
	return pose_apply(s->rt_stage_head, vec3_add(s->state->labels[i].master_m, shift_m));
}

static double pair_cost(const struct search *s, int i, double distance2_m2)
{
	float scale_mm2 = fminf(fmaxf(s->state->rows[i].worst_mm2, SCALE_MIN_MM * SCALE_MIN_MM),
				SCALE_MAX_MM * SCALE_MAX_MM);

	return fmin(distance2_m2 / (MM * MM * (double)scale_mm2), LOST_COST);
}

static float moves_mm(const struct expression_row *row, int pattern)
{
	float x = row->shift_mm[0][pattern], y = row->shift_mm[1][pattern],
	      z = row->shift_mm[2][pattern];

	return sqrtf(x * x + y * y + z * z);
}

/* What moves skin farthest, and who is asked about it. */
struct sweep {
	int pattern;
	float most_mm; /* of a marker, by one unit of it */
	float row;     /* so many units move them to where the next row was, in the mean */
	int count;
	int16_t movers[LABEL_MAX];
};

static void pick_pattern(const struct search *s, struct sweep *sweep)
{
	sweep->most_mm = 0;
	for (int k = 1; k < s->state->expressions[s->actor].count; k++)
		for (int i = s->first; i < s->end; i++) {
			float mm = is_asked(s, i) ? moves_mm(&s->state->rows[i], k) : 0;

			if (mm <= sweep->most_mm)
				continue;
			sweep->most_mm = mm;
			sweep->pattern = k;
		}
}

static void pick_movers(const struct search *s, struct sweep *sweep)
{
	double spacing_mm = 0, sum_mm = 0;

	sweep->count = 0;
	for (int i = s->first; i < s->end; i++) {
		const struct label_state *label = &s->state->labels[i];
		float mm = is_asked(s, i) ? moves_mm(&s->state->rows[i], sweep->pattern) : 0;

		if (mm < MOVES_SHARE * sweep->most_mm ||
		    (double)(s->now_ns - label->seen_ns) * 1e-9 > SEEN_S)
			continue;
		sweep->movers[sweep->count++] = (int16_t)i;
		spacing_mm += label->spacing_m / MM;
		sum_mm += mm;
	}
	sweep->row = (float)(spacing_mm / sum_mm);
}

/* Without regard to who else is near a point. */
static double scan_cost(const struct search *s, const struct sweep *sweep, const float *amount)
{
	double sum = 0, distance2_m2;

	for (int k = 0; k < sweep->count; k++) {
		int i = sweep->movers[k];

		nearby_nearest(s->nearby, place_m(s, i, amount), REACH_M, &distance2_m2);
		sum += pair_cost(s, i, distance2_m2);
	}
	return sum;
}

static float amount_at(float last, const struct sweep *sweep, int place)
{
	return last + (SCAN_MM * (float)place - SCAN_REACH_MM) / sweep->most_mm;
}

/* The two best of the places that are better than those beside them. Returns how many there are. */
static int scan(const struct search *s, const struct sweep *sweep, float *amount,
		float starts[SCAN_STARTS])
{
	double cost[SCAN_COUNT], best[SCAN_STARTS] = {INFINITY, INFINITY};
	float last = amount[sweep->pattern];

	starts[0] = last;
	for (int n = 0; n < SCAN_COUNT; n++) {
		amount[sweep->pattern] = amount_at(last, sweep, n);
		cost[n] = scan_cost(s, sweep, amount);
	}
	for (int n = 0; n < SCAN_COUNT; n++) {
		if ((n > 0 && cost[n - 1] < cost[n]) ||
		    (n < SCAN_COUNT - 1 && cost[n + 1] <= cost[n]) || cost[n] >= best[1])
			continue;
		bool is_best = cost[n] < best[0];

		best[1] = is_best ? best[0] : cost[n];
		starts[1] = is_best ? starts[0] : amount_at(last, sweep, n);
		if (is_best) {
			best[0] = cost[n];
			starts[0] = amount_at(last, sweep, n);
		}
	}
	return (best[0] < INFINITY) + (best[1] < INFINITY);
}

/* Each marker with the nearest point, each point with the nearest marker. False: as before. */
static bool pair_up(const struct search *s, const float *amount, struct reading *r)
{
	int16_t taken_by[POINT_MAX], before[LABEL_MAX];

	memcpy(before, r->entry_of_label, sizeof(before));
	for (int k = 0; k < s->nearby->count; k++)
		taken_by[k] = LABEL_NONE;
	for (int i = s->first; i < s->end; i++) {
		double *own_m2 = &r->distance2_m2[i];

		r->entry_of_label[i] = -1;
		if (!is_asked(s, i))
			continue;
		int k = nearby_nearest(s->nearby, place_m(s, i, amount), REACH_M, own_m2);
		if (k < 0 || (taken_by[k] >= 0 && r->distance2_m2[taken_by[k]] <= *own_m2))
			continue;
		if (taken_by[k] >= 0)
			r->entry_of_label[taken_by[k]] = -1;
		taken_by[k] = (int16_t)i;
		r->entry_of_label[i] = (int16_t)k;
	}
	return memcmp(before, r->entry_of_label, sizeof(before)) != 0;
}

static double cost_of(const struct search *s, const struct reading *r)
{
	double sum = 0;

	for (int i = s->first; i < s->end; i++)
		if (r->entry_of_label[i] >= 0)
			sum += pair_cost(s, i, r->distance2_m2[i]) - PAIR_WORTH;
	return sum;
}

static void solve_pairs(const struct search *s, struct reading *r)
{
	struct pose back = pose_inverse(s->rt_stage_head);
	struct vec3 seen_m[LABEL_MAX];
	bool tells[LABEL_MAX];

	for (int i = s->first; i < s->end; i++) {
		tells[i] = r->entry_of_label[i] >= 0;
		if (tells[i])
			seen_m[i] = pose_apply(&back, s->nearby->p_stage_m[r->entry_of_label[i]]);
	}
	expression_solve(s->state, s->actor, s->now_ns, tells, seen_m, &r->expression);
}

/* False: too few markers have a point. */
static bool read_from(const struct search *s, const float *amount, struct reading *r)
{
	for (int i = 0; i < LABEL_MAX; i++)
		r->entry_of_label[i] = -1;
	pair_up(s, amount, r);
	for (int round = 0; round < ROUNDS; round++) {
		solve_pairs(s, r);
		if (!r->expression.known)
			return false;
		if (!pair_up(s, r->expression.amount, r))
			break;
	}
	r->cost = cost_of(s, r);
	return true;
}

static bool are_same(const struct search *s, const struct reading *a, const struct reading *b)
{
	for (int i = s->first; i < s->end; i++)
		if (is_asked(s, i) && vec3_distance(place_m(s, i, a->expression.amount),
						    place_m(s, i, b->expression.amount)) > SAME_M)
			return false;
	return true;
}

/* Takes back what a rival that is nearly as good reads otherwise. */
static void doubt(const struct search *s, const struct reading *best, const struct reading *rival,
		  struct expression_search *out)
{
	int apart = 0;

	for (int i = s->first; i < s->end; i++)
		apart += best->entry_of_label[i] != rival->entry_of_label[i];
	if (rival->cost - best->cost > APART_MARGIN * apart)
		return;
	for (int i = s->first; i < s->end; i++)
		if (best->entry_of_label[i] != rival->entry_of_label[i])
			out->point_of_label[i] = -1;
}

struct readings {
	int count;
	struct reading readings[READINGS_MAX];
	const struct reading *best; /* or NULL */
};

/* True: this is the best so far. */
static bool try_from(const struct search *s, const float *amount, struct readings *r)
{
	struct reading *own = &r->readings[r->count];

	if (r->count == READINGS_MAX || !read_from(s, amount, own))
		return false;
	r->count++;
	if (r->best && r->best->cost <= own->cost)
		return false;
	r->best = own;
	return true;
}

/* From the best reading towards those that are rows aside, while that is better. */
static void try_rows_aside(const struct search *s, const struct sweep *sweep, struct readings *r)
{
	for (int side = -1; side <= 1; side += 2) {
		float amount[PATTERN_MAX];

		do {
			memcpy(amount, r->best->expression.amount, sizeof(amount));
			amount[sweep->pattern] += (float)side * sweep->row;
		} while (try_from(s, amount, r));
	}
}

static void read_face(const struct search *s, struct readings *r)
{
	const struct expression_state *x = &s->state->expressions[s->actor];
	float amount[PATTERN_MAX] = {1}, starts[SCAN_STARTS];
	struct sweep sweep = {.count = 0};

	for (int k = 1; k < x->count; k++)
		amount[k] = (float)x->amount[k];
	pick_pattern(s, &sweep);
	if (sweep.most_mm > MOVES_MM)
		pick_movers(s, &sweep);
	if (sweep.count == 0) {
		try_from(s, amount, r);
		return;
	}
	int count = scan(s, &sweep, amount, starts);
	for (int n = 0; n < count; n++) {
		amount[sweep.pattern] = starts[n];
		try_from(s, amount, r);
	}
	if (r->best)
		try_rows_aside(s, &sweep, r);
}

void expression_search(const struct tracker_state *state, int actor, int64_t now_ns,
		       const struct nearby *nearby, const struct pose *rt_stage_head,
		       struct expression_search *out)
{
	const struct frame_state *f = &state->frames[actor];
	struct search s = {state,  actor,  f->label_first, f->label_end,
			   now_ns, nearby, rt_stage_head};
	struct readings r;

	r.count = 0;
	r.best = NULL;
	read_face(&s, &r);
	out->known = r.best != NULL;
	if (!r.best)
		return;
	out->expression = r.best->expression;
	for (int i = s.first; i < s.end; i++) {
		int entry = r.best->entry_of_label[i];

		out->point_of_label[i] = (int16_t)(entry < 0 ? -1 : nearby->point[entry]);
	}
	for (int n = 0; n < r.count; n++)
		if (&r.readings[n] != r.best && !are_same(&s, r.best, &r.readings[n]))
			doubt(&s, r.best, &r.readings[n], out);
}
