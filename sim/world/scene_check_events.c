/*
 * Events of a scene file: whose, of what, how much and when.
 */
#include <stdio.h>
#include <string.h>

#include "sim/face/body.h"
#include "sim/face/face.h"
#include "sim/world/scene_file_parts.h"

enum what { WHAT_NOTHING, WHAT_EXPRESSION, WHAT_MARKER, WHAT_GROUP };

/* What each kind of event needs. */
static const struct rule {
	bool nobodys; /* it happens to no actor alone */
	bool lasts;   /* for_s is needed */
	enum what what;
	double min, max; /* of the amount, when it needs one */
	const char *unit;
} rules[] = {
	[SIM_EVENT_EXPRESSION] = {false, true, WHAT_EXPRESSION, 0, 1, "of the whole expression"},
	[SIM_EVENT_FALL_OFF] = {false, false, WHAT_MARKER, 0, 0, NULL},
	[SIM_EVENT_HAND] = {false, true, WHAT_NOTHING, 0, 0, NULL},
	[SIM_EVENT_PASSER] = {true, true, WHAT_NOTHING, 0, 0, NULL},
	[SIM_EVENT_JIG_SLIP] = {false, false, WHAT_NOTHING, 0.1, 50, "millimetres"},
	[SIM_EVENT_TURN] = {false, true, WHAT_NOTHING, -90, 90, "degrees"},
	[SIM_EVENT_MICRO] = {false, true, WHAT_GROUP, 0.01, 10, "millimetres"},
};

struct checking {
	struct yaml *yaml;
	const struct scene_reading *r;
	uint32_t index;
	const struct sim_event *event;
	const struct rule *rule;
};

static struct scene_spot spot_of(const struct checking *c, int key, const char *name)
{
	struct yaml_place item = {c->event->line, c->event->column};

	return scene_spot("events", c->index, name, c->r->event_places[c->index][key], item);
}

static bool is_given(const struct checking *c, int key)
{
	return c->r->event_places[c->index][key].line != 0;
}

/* Whom it happens to; NULL with a message when that is nobody. */
static const struct sim_actor_script *find_actor(const struct checking *c)
{
	const struct sim_script *script = &c->r->script;
	struct scene_spot spot = spot_of(c, EVENT_ACTOR, "actor");

	if (!is_given(c, EVENT_ACTOR)) {
		if (script->actor_count == 1)
			return &script->actors[0];
		yaml_complain(c->yaml, spot.place, spot.field, "which of the %u actors?",
			      script->actor_count);
		return NULL;
	}
	for (uint32_t i = 0; i < script->actor_count; i++)
		if (strcmp(script->actors[i].name, c->event->actor) == 0)
			return &script->actors[i];
	if (*c->event->actor)
		yaml_complain(c->yaml, spot.place, spot.field, "there is no actor '%s'",
			      c->event->actor);
	return NULL;
}

static bool is_called(const struct layout_marker *marker, enum what what, const char *name)
{
	return strcmp(what == WHAT_MARKER ? marker->name : marker->group, name) == 0;
}

/* Names do not depend on the seed. Groups are those of the face. */
static bool wears(const struct sim_actor_script *actor, enum what what, const char *name)
{
	const struct face_options options = {.marker_count = actor->face_markers};
	static struct face face; /* control thread only; too large for its stack */
	static struct body body;

	face_init(&face, &options, 1);
	for (uint32_t m = 0; m < face.marker_count; m++)
		if (is_called(&face.markers[m].wanted, what, name))
			return true;
	if (!actor->body_markers || what != WHAT_MARKER)
		return false;
	body_init(&body, true, 0, 1);
	for (int m = 0; m < BODY_MARKER_COUNT; m++)
		if (is_called(&body.markers[m].wanted, what, name))
			return true;
	return false;
}

static bool is_known(enum what what, const char *name, const struct sim_actor_script *actor)
{
	return what == WHAT_EXPRESSION ? face_pose_find(name) >= 0 : wears(actor, what, name);
}

static void check_what(const struct checking *c, const struct sim_actor_script *actor)
{
	static const char *const words[] = {"", "expression", "marker", "marker group"};
	enum what what = c->rule->what;
	struct scene_spot spot = spot_of(c, EVENT_WHAT, "what");

	if (what == WHAT_NOTHING && is_given(c, EVENT_WHAT))
		yaml_complain(c->yaml, spot.place, spot.field, "this kind of event has none");
	else if (what != WHAT_NOTHING && !is_given(c, EVENT_WHAT))
		yaml_complain(c->yaml, spot.place, spot.field, "missing: which %s?", words[what]);
	else if (what != WHAT_NOTHING && actor && *c->event->what &&
		 !is_known(what, c->event->what, actor))
		yaml_complain(c->yaml, spot.place, spot.field, "actor '%s' has no %s '%s'",
			      actor->name, words[what], c->event->what);
}

static void check_amount(const struct checking *c)
{
	const struct rule *rule = c->rule;
	double amount = c->event->amount;
	struct scene_spot spot = spot_of(c, EVENT_AMOUNT, "amount");

	if (!rule->unit && is_given(c, EVENT_AMOUNT))
		yaml_complain(c->yaml, spot.place, spot.field, "this kind of event has none");
	else if (rule->unit && !is_given(c, EVENT_AMOUNT))
		yaml_complain(c->yaml, spot.place, spot.field, "missing: from %g to %g (%s)",
			      rule->min, rule->max, rule->unit);
	else if (rule->unit && (amount < rule->min || amount > rule->max))
		yaml_complain(c->yaml, spot.place, spot.field,
			      "%g is out of range, expected %g to %g (%s)", amount, rule->min,
			      rule->max, rule->unit);
}

static void check_time(const struct checking *c)
{
	double seconds = c->r->script.seconds;
	struct scene_spot at = spot_of(c, EVENT_AT, "at_s");
	struct scene_spot lasting = spot_of(c, EVENT_FOR, "for_s");

	if (seconds > 0 && c->event->at_s >= seconds)
		yaml_complain(c->yaml, at.place, at.field, "%g s is after the scene's end at %g s",
			      c->event->at_s, seconds);
	if (c->rule->lasts && c->event->for_s <= 0)
		yaml_complain(c->yaml, lasting.place, lasting.field,
			      "missing: how many seconds does it take?");
}

void scene_check_events(struct yaml *yaml, const struct scene_reading *r)
{
	for (uint32_t i = 0; i < r->script.event_count; i++) {
		const struct sim_event *event = &r->script.events[i];
		struct checking c = {yaml, r, i, event, NULL};

		if (event->kind < 0) /* unknown, and said so */
			continue;
		c.rule = &rules[event->kind];
		check_time(&c);
		check_amount(&c);
		check_what(&c,
			   c.rule->nobodys && !is_given(&c, EVENT_ACTOR) ? NULL : find_actor(&c));
	}
}
