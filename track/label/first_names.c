/*
 * Leftovers near a label, and who should have been seen.
 */
#include "track/label/first_names.h"

#include "track/label/wear.h"

#define REACH_M 0.035 /* a reading that is aside comes out uneven within this */
#define ROW_MIN 3     /* a row read aside leaves over as many; fewer are hidden or strays */
#define TELLERS_MIN 3
#define EXPECTED_SHARE 0.8 /* of those about a marker: what they see it should be seen by, too */
#define HIDDEN_MAX 1       /* neighbours without a point in a whole reading */
#define OPEN_MAX 2         /* neighbours without a name about an enclosed label */
#define REST_SHARE 0.15    /* of the distance to the next marker */
#define REST_MARKERS 0.9   /* of a face's, so near to their places: it is neutral */
#define REST_MIN 12

/* Cameras that see most of the markers about this one. */
static int cameras_about(const struct labelling *l, const struct point *points,
			 const struct label_state *label)
{
	uint32_t masks[WATCH_MAX + NEIGHBOUR_MAX];
	int count = 0, cameras = 0;

	for (int k = 0; k < WATCH_MAX; k++)
		if (label->watch[k] >= 0 && l->assign.column_of_row[label->watch[k]] >= 0)
			masks[count++] =
				points[l->assign.column_of_row[label->watch[k]]].fix.used_mask;
	for (int k = 0; k < label->neighbour_count; k++) {
		int column = l->assign.column_of_row[label->neighbours[k].label];

		if (column >= 0)
			masks[count++] = points[column].fix.used_mask;
	}
	for (int c = 0; c < CAMERA_MAX && count >= TELLERS_MIN; c++) {
		int see_it = 0;

		for (int k = 0; k < count; k++)
			see_it += masks[k] >> c & 1;
		cameras += see_it >= EXPECTED_SHARE * count;
	}
	return cameras;
}

static bool face_rests(const struct tracker_state *state, const struct labelling *l, int actor)
{
	const struct frame_state *f = &state->frames[actor];
	int seen = 0, rests = 0;

	for (int i = f->label_first; i < f->label_end; i++) {
		const struct label_state *label = &state->labels[i];

		if (label->frame != actor || label->kind != LABEL_SKIN || !l->seen[i])
			continue;
		seen++;
		rests += vec3_distance(label->base_m, l->seen_m[i]) < REST_SHARE * label->spacing_m;
	}
	return seen >= REST_MIN && rests >= REST_MARKERS * seen;
}

void first_names_look(const struct tracker_state *state, const struct labelling *l,
		      const struct point *points, struct leftovers *out)
{
	const struct nearby *n = &l->nearby;

	out->label_count = out->point_count = 0;
	for (uint32_t a = 0; a < state->actor_count; a++)
		out->rests[a] = l->found[a] && face_rests(state, l, (int)a);
	for (uint32_t i = 0; i < state->label_count; i++) {
		const struct label_state *label = &state->labels[i];

		out->is_lonely[i] = label->kind == LABEL_SKIN && l->found[label->frame] &&
				    l->assign.column_of_row[i] == ASSIGN_NONE &&
				    !wear_is_gone(label) && cameras_about(l, points, label) >= 3;
		if (out->is_lonely[i])
			out->labels[out->label_count++] = (int16_t)i;
	}
	for (int k = 0; k < n->count; k++)
		if (l->assign.row_of_column[n->point[k]] == ASSIGN_NONE &&
		    !l->is_ghost[n->point[k]])
			out->p_stage_m[out->point_count++] = n->p_stage_m[k];
}

static bool neighbours_there(const struct labelling *l, const struct label_state *own)
{
	int there = 0;

	for (int k = 0; k < own->neighbour_count; k++)
		there += l->seen[own->neighbours[k].label];
	return there >= TELLERS_MIN && there >= own->neighbour_count - HIDDEN_MAX;
}

enum reading first_names_read(const struct tracker_state *state, const struct labelling *l,
			      const struct leftovers *leftovers, uint32_t label)
{
	const struct label_state *own = &state->labels[label];
	struct vec3 seen_m = pose_apply(&l->rt_stage_frame[own->frame], l->seen_m[label]);
	int labels = 0, points = 0;

	for (uint32_t k = 0; k < leftovers->label_count; k++) {
		const struct label_state *other = &state->labels[leftovers->labels[k]];

		labels += other->frame == own->frame &&
			  vec3_distance(other->base_m, own->base_m) < REACH_M;
	}
	for (uint32_t k = 0; k < leftovers->point_count; k++)
		points += vec3_distance(leftovers->p_stage_m[k], seen_m) < REACH_M;
	if (labels > 0 && points > 0)
		return READING_SHIFTED;
	if (labels + points == 0 && neighbours_there(l, own))
		return READING_WHOLE;
	return labels + points >= ROW_MIN ? READING_UNEVEN : READING_EVEN;
}

bool first_names_enclosed(const struct tracker_state *state, const struct labelling *l,
			  const struct leftovers *leftovers, uint32_t label)
{
	const struct label_state *own = &state->labels[label];
	int named = 0, open = 0;

	for (int k = 0; k < own->neighbour_count; k++) {
		int other = own->neighbours[k].label;
		bool has_name = l->seen[other] && l->motion.labels[other].recent;

		named += has_name;
		open += leftovers->is_lonely[other] ||
			(!has_name && l->assign.column_of_row[other] != ASSIGN_NONE);
	}
	return named >= TELLERS_MIN && open <= OPEN_MAX;
}
