/*
 * What events do. All of it moves smoothly but a marker that falls off.
 */
#include "sim/happen.h"

#include <errno.h>
#include <string.h>

#include "base/rng.h"
#include "sim/face/ease.h"
#include "sim/occlude.h"
#include "sim/world/scene_parts.h"

#define MM 1e-3
#define RAD (M_PI / 180.0)
#define SLIP_S 0.15
#define SLIP_RAD_PER_M 5.0 /* a slip of 5 mm turns the band by 1.4 degrees */
#define TURN_DEG_PER_S 90.0
#define PASSER_AHEAD_M 0.65
#define PASSER_PATH_M 2.6

static int find_actor(const struct sim_script *script, const char *name)
{
	for (uint32_t a = 0; a < script->actor_count; a++)
		if (!*name || strcmp(script->actors[a].name, name) == 0)
			return (int)a;
	return -1;
}

static bool find_marker(const struct scene_actor *actor, const char *name, uint32_t *marker)
{
	for (uint32_t m = 0; m < actor->marker_count; m++)
		if (strcmp(scene_actor_marker(actor, m)->name, name) == 0) {
			*marker = m;
			return true;
		}
	return false;
}

static bool find_group(const struct scene_actor *actor, const char *name, uint64_t *members)
{
	bool found = false;

	for (uint32_t m = 0; m < actor->face.marker_count; m++)
		if (strcmp(actor->face.markers[m].wanted.group, name) == 0) {
			members[m / 64] |= UINT64_C(1) << (m % 64);
			found = true;
		}
	return found;
}

/* Returns what is not there, or NULL. */
static const char *resolve(struct happening *h, const struct sim_event *event,
			   const struct scene_actor *actor)
{
	if (h->kind == SIM_EVENT_EXPRESSION) {
		h->pose = face_pose_find(event->what);
		return h->pose < 0 ? "expression" : NULL;
	}
	if (h->kind == SIM_EVENT_FALL_OFF)
		return find_marker(actor, event->what, &h->marker) ? NULL : "marker";
	if (h->kind == SIM_EVENT_MICRO)
		return find_group(actor, event->what, h->members) ? NULL : "marker group";
	return NULL;
}

/* A band slips along the forehead: to a side, back or forward, hardly up. */
static struct vec3 slip_way(uint64_t seed, uint32_t index)
{
	double angle = 2 * M_PI * signal_dice(seed + 77, index);

	return vec3_unit((struct vec3){cos(angle), 0.3, sin(angle)});
}

int happenings_init(struct happenings *happenings, const struct sim_script *script,
		    const struct scene_actor *actors, uint64_t seed, struct diag *diag)
{
	int error = 0;

	happenings->count = 0;
	for (uint32_t i = 0; i < script->event_count; i++) {
		const struct sim_event *event = &script->events[i];
		int actor = find_actor(script, event->actor);
		struct happening h = {.kind = event->kind,
				      .actor = (uint32_t)actor,
				      .from_s = event->at_s,
				      .to_s = event->for_s > 0 ? event->at_s + event->for_s
							       : INFINITY,
				      .amount = event->amount,
				      .way = slip_way(seed, i)};
		const char *lack = actor < 0 ? "actor" : resolve(&h, event, &actors[actor]);

		if (lack) {
			diag_add(diag, "scene %s: line %d, column %d: there is no %s '%s'",
				 script->name, event->line, event->column, lack,
				 actor < 0 ? event->actor : event->what);
			error = -EINVAL;
			continue;
		}
		happenings->list[happenings->count++] = h;
	}
	return error;
}

/* 0 to 1 and back, by the time the event has. */
static double strength(const struct happening *h, double time_s, double rise_s)
{
	double rise = fmin(rise_s, 0.5 * (h->to_s - h->from_s));

	if (isinf(h->to_s))
		return ease((time_s - h->from_s) / rise_s);
	return swell(time_s, h->from_s, h->to_s, rise);
}

static bool happens(const struct happening *h, int kind, uint32_t actor, double time_s)
{
	return h->kind == kind && h->actor == actor && time_s > h->from_s && time_s < h->to_s;
}

/* A blink leaves the mouth alone: what opens and shuts it goes on. */
static bool is_of_lids(enum face_basis basis)
{
	return basis == BASIS_BLINK_L || basis == BASIS_BLINK_R || basis == BASIS_SQUINT;
}

static bool is_blink(int pose)
{
	double weights[BASIS_COUNT] = {0};

	face_pose_add(pose, 1, weights);
	for (int b = 0; b < BASIS_COUNT; b++)
		if (weights[b] != 0 && !is_of_lids(b))
			return false;
	return true;
}

void happenings_express(const struct happenings *happenings, uint32_t actor, double time_s,
			double weights[BASIS_COUNT])
{
	for (uint32_t i = 0; i < happenings->count; i++) {
		const struct happening *h = &happenings->list[i];

		if (!happens(h, SIM_EVENT_EXPRESSION, actor, time_s))
			continue;
		double held = strength(h, time_s, EASE_RISE_S);

		bool blink = is_blink(h->pose);

		for (int b = 0; b < BASIS_COUNT; b++)
			if (!blink || is_of_lids(b))
				weights[b] *= 1 - held;
		face_pose_add(h->pose, held * h->amount, weights);
	}
}

double happenings_turn_rad(const struct happenings *happenings, uint32_t actor, double time_s)
{
	double turn_rad = 0;

	for (uint32_t i = 0; i < happenings->count; i++) {
		const struct happening *h = &happenings->list[i];
		double rise_s = fmax(EASE_RISE_S, fabs(h->amount) / TURN_DEG_PER_S);

		if (happens(h, SIM_EVENT_TURN, actor, time_s))
			turn_rad += strength(h, time_s, rise_s) * h->amount * RAD;
	}
	return turn_rad;
}

struct pose happenings_band(const struct happenings *happenings, uint32_t actor, double time_s)
{
	struct pose band = POSE_IDENTITY;

	for (uint32_t i = 0; i < happenings->count; i++) {
		const struct happening *h = &happenings->list[i];

		if (!happens(h, SIM_EVENT_JIG_SLIP, actor, time_s))
			continue;
		double slip_m = strength(h, time_s, SLIP_S) * h->amount * MM;
		struct vec3 axis = vec3_unit(vec3_cross((struct vec3){0, 1, 0}, h->way));
		struct pose slip =
			pose_from_rotation_vector(vec3_scale(axis, slip_m * SLIP_RAD_PER_M));

		slip.t = vec3_scale(h->way, 0.7 * slip_m);
		band = pose_compose(&slip, &band);
	}
	return band;
}

double happenings_micro_m(const struct happenings *happenings, uint32_t actor, uint32_t marker,
			  double time_s)
{
	double moved_m = 0;

	for (uint32_t i = 0; i < happenings->count; i++) {
		const struct happening *h = &happenings->list[i];

		if (happens(h, SIM_EVENT_MICRO, actor, time_s) &&
		    h->members[marker / 64] >> (marker % 64) & 1)
			moved_m += strength(h, time_s, EASE_RISE_S) * h->amount * MM;
	}
	return moved_m;
}

bool happenings_worn(const struct happenings *happenings, uint32_t actor, uint32_t marker,
		     double time_s)
{
	for (uint32_t i = 0; i < happenings->count; i++)
		if (happens(&happenings->list[i], SIM_EVENT_FALL_OFF, actor, time_s) &&
		    happenings->list[i].marker == marker)
			return false;
	return true;
}

/* Close along the face from below the left cheek, over nose and mouth, to the right; with the
 * forearm. */
static uint32_t add_hand(const struct pose *rt_stage_neck, double share,
			 struct sim_truth_occluder *out)
{
	double azimuth_rad = (0.5 - share) * 170 * RAD, away_m = 0.11 + 0.04 * cos(azimuth_rad);
	struct pose hand = pose_from_rotation_vector((struct vec3){0, azimuth_rad, 0});
	struct vec3 palm = {away_m * sin(azimuth_rad), -0.22 + 0.2 * sin(M_PI * share),
			    away_m * cos(azimuth_rad)};
	struct pose arm = hand;

	hand.t = palm;
	arm.t = vec3_add(palm, pose_rotate(&hand, (struct vec3){0, -0.24, 0.02}));
	hand = pose_compose(rt_stage_neck, &hand);
	arm = pose_compose(rt_stage_neck, &arm);
	out[0] = occluder_make(&hand, (struct vec3){52 * MM, 100 * MM, 13 * MM});
	out[1] = occluder_make(&arm, (struct vec3){35 * MM, 170 * MM, 35 * MM});
	return 2;
}

/* Somebody upright who walks by in front of the seat, from its left to its right. */
static uint32_t add_passer(const struct pose *rt_stage_neck, double share,
			   struct sim_truth_occluder *out)
{
	struct vec3 place = {(0.5 - share) * PASSER_PATH_M, 0, PASSER_AHEAD_M};
	struct pose upright = POSE_IDENTITY;

	upright.t = pose_apply(rt_stage_neck, place);
	out[0] = occluder_make(&upright, (struct vec3){0.2, 0.2, 0.9});
	return 1;
}

uint32_t happenings_occluders(const struct happenings *happenings, const struct pose *rt_stage_neck,
			      double time_s, struct sim_truth_occluder *out, uint32_t room)
{
	uint32_t count = 0;

	for (uint32_t i = 0; i < happenings->count; i++) {
		const struct happening *h = &happenings->list[i];
		double share = (time_s - h->from_s) / (h->to_s - h->from_s);
		const struct pose *neck = &rt_stage_neck[h->actor];

		if (count + 2 > room || !(share > 0 && share < 1))
			continue;
		if (h->kind == SIM_EVENT_HAND)
			count += add_hand(neck, share, &out[count]);
		else if (h->kind == SIM_EVENT_PASSER)
			count += add_passer(neck, share, &out[count]);
	}
	return count;
}
