/*
 * Before the first shot: which markers move as one, which neighbours speak for which, and what is
 * thought of them until they are learned.
 */
#include <assert.h>
#include <string.h>

#include "track/label/jaw.h"
#include "track/predict.h"
#include "track/predict_parts.h"

#define HEAD_CARRY_S 0.1
#define SEGMENT_CARRY_S 0.03 /* it turns about a place far from its markers */
#define PRIOR_SPREAD 0.2     /* of the distance between two neighbours */
#define REST_PRIOR_M2 (0.003 * 0.003)
#define NEIGHBOUR_DISTANCE_MAX_M 0.06

static void insert_neighbour(struct label_state *label, const double *distance_m, int16_t other)
{
	int place = label->neighbour_count;

	while (place > 0 && distance_m[label->neighbours[place - 1].label] > distance_m[other])
		place--;
	if (place == NEIGHBOUR_MAX)
		return;
	if (label->neighbour_count < NEIGHBOUR_MAX)
		label->neighbour_count++;
	for (int k = label->neighbour_count - 1; k > place; k--)
		label->neighbours[k] = label->neighbours[k - 1];
	double spread_m = PRIOR_SPREAD * distance_m[other];
	label->neighbours[place] =
		(struct neighbour){.label = other,
				   .gain = 1,
				   .leaves = (spread_m * spread_m + SPREAD_MIN_M2) / SMALL_M2};
}

/* Two groups that differ in upper and lower alone: lips, or lids. They lie close and part. */
static bool groups_oppose(const char *a, const char *b)
{
	const char *upper = strstr(a, "upper"), *lower = strstr(b, "lower");

	return upper && lower && upper - a == lower - b &&
	       strncmp(a, b, (size_t)(upper - a)) == 0 && strcmp(upper + 5, lower + 5) == 0;
}

bool predict_opposes(const char *group, const char *other)
{
	return groups_oppose(group, other) || groups_oppose(other, group);
}

static bool may_speak_for(const struct tracker_state *state, const struct layout *layout,
			  uint32_t a, uint32_t b)
{
	const struct label_state *label = &state->labels[a], *other = &state->labels[b];
	const char *group = layout->markers[a].group, *its = layout->markers[b].group;

	/* a rigid marker says nothing of skin, nor skin of it */
	return a != b && label->frame == other->frame && label->kind == LABEL_SKIN &&
	       other->kind == LABEL_SKIN && !predict_opposes(group, its);
}

/* Keeps the nearest others of the frame, whatever they say of it. */
static void init_watch(struct tracker_state *state, struct label_state *label, uint32_t first,
		       uint32_t end)
{
	for (int k = 0; k < WATCH_MAX; k++)
		label->watch[k] = LABEL_NONE;
	for (uint32_t i = first; i < end; i++) {
		const struct label_state *other = &state->labels[i];
		int16_t moving = (int16_t)i;

		if (other == label || other->frame != label->frame)
			continue;
		for (int k = 0; k < WATCH_MAX; k++) {
			int16_t held = label->watch[k];

			if (held >= 0 &&
			    vec3_distance(label->master_m, state->labels[held].master_m) <=
				    vec3_distance(label->master_m, state->labels[moving].master_m))
				continue;
			label->watch[k] = moving;
			if (held < 0)
				break;
			moving = held;
		}
	}
}

/* The nearest one across on the lower lip or lid. */
static int16_t find_below(const struct layout *layout, const struct layout_actor *actor, uint32_t i)
{
	const struct layout_marker *own = &layout->markers[i];
	int16_t below = LABEL_NONE;
	double least_m = INFINITY;

	for (uint32_t k = actor->first; k < actor->first + actor->count; k++) {
		const struct layout_marker *other = &layout->markers[k];
		double distance_m = vec3_distance(own->neutral_m, other->neutral_m);

		if (distance_m >= least_m || !groups_oppose(own->group, other->group) ||
		    own->neutral_m.y <= other->neutral_m.y)
			continue;
		least_m = distance_m;
		below = (int16_t)k;
	}
	return below;
}

static void init_neighbours(struct tracker_state *state, const struct layout *layout, uint32_t i)
{
	const struct layout_actor *actor = &layout->actors[state->labels[i].actor];
	struct label_state *label = &state->labels[i];
	double distance_m[LABEL_MAX];

	label->below = find_below(layout, actor, i);
	label->spacing_m = INFINITY;
	for (uint32_t k = actor->first; k < actor->first + actor->count; k++) {
		distance_m[k] =
			vec3_distance(layout->markers[i].neutral_m, layout->markers[k].neutral_m);
		if (k != i)
			label->spacing_m = fmin(label->spacing_m, distance_m[k]);
		if (may_speak_for(state, layout, i, k) && distance_m[k] < NEIGHBOUR_DISTANCE_MAX_M)
			insert_neighbour(label, distance_m, (int16_t)k);
	}
}

/* The segment's frame, a new one for the first marker that names it. */
static int16_t frame_of(struct tracker_state *state, const struct layout *layout, uint32_t i)
{
	int16_t actor = state->labels[i].actor;

	if (!layout->markers[i].segment[0])
		return actor;
	for (uint32_t k = layout->actors[actor].first; k < i; k++)
		if (strcmp(layout->markers[k].segment, layout->markers[i].segment) == 0)
			return state->labels[k].frame;
	assert(state->frame_count < FRAME_MAX);
	state->frames[state->frame_count].actor = actor;
	state->frames[state->frame_count].carry_s = SEGMENT_CARRY_S;
	return (int16_t)state->frame_count++;
}

static void init_label(struct tracker_state *state, const struct layout *layout, int16_t actor,
		       uint32_t i)
{
	const struct layout_marker *marker = &layout->markers[i];
	struct label_state *label = &state->labels[i];

	label->actor = actor;
	label->kind = marker->segment[0] ? LABEL_BODY : marker->rigid ? LABEL_SKULL : LABEL_SKIN;
	label->frame = frame_of(state, layout, i);
	label->master_m = label->base_m = label->rest_m = marker->neutral_m;
	label->rest_variance_m2 = REST_PRIOR_M2;
	label->diameter_m = marker->diameter_m;
	state->diameter_min_m = fmin(i ? state->diameter_min_m : INFINITY, label->diameter_m);
	state->diameter_max_m = fmax(state->diameter_max_m, label->diameter_m);
	struct frame_state *frame = &state->frames[label->frame];
	if (frame->label_count++ == 0)
		frame->label_first = (uint16_t)i;
	frame->label_end = (uint16_t)(i + 1);
}

void predict_init(struct tracker_state *state, const struct layout *layout)
{
	state->label_count = layout->marker_count;
	state->actor_count = state->frame_count = layout->actor_count;
	for (uint32_t a = 0; a < layout->actor_count; a++) {
		const struct layout_actor *actor = &layout->actors[a];

		state->frames[a].actor = (int16_t)a;
		state->frames[a].carry_s = HEAD_CARRY_S;
		for (uint32_t i = actor->first; i < actor->first + actor->count; i++)
			init_label(state, layout, (int16_t)a, i);
		for (uint32_t i = actor->first; i < actor->first + actor->count; i++)
			init_neighbours(state, layout, i);
		for (uint32_t i = actor->first; i < actor->first + actor->count; i++)
			init_watch(state, &state->labels[i], actor->first,
				   actor->first + actor->count);
		jaw_init(state, layout, (int)a);
		expression_init(state, (int)a);
	}
}
