/*
 * Who is on the stage: actors as the script wants them, each with its own seed.
 */
#include <errno.h>
#include <string.h>

#include "sim/world/scene_parts.h"

#define DISC_FACING_MIN 0.20 /* a flat disc shines back up to about 78 degrees */
#define DOME_FACING_MIN 0.0

const struct layout_marker *scene_actor_marker(const struct scene_actor *actor, uint32_t m)
{
	uint32_t face_count = actor->face.marker_count;

	return m < face_count ? &actor->face.markers[m].wanted
			      : &actor->body.markers[m - face_count].wanted;
}

static uint64_t actor_seed(uint64_t seed, uint32_t actor)
{
	return seed + actor * UINT64_C(0x9e3779b97f4a7c15);
}

static void make_actor(struct scene_actor *actor, const struct sim_actor_script *script,
		       double seconds, uint64_t seed)
{
	struct face_options options = {.marker_count = script->face_markers,
				       .diameter_m = script->face_diameter_m,
				       .reapplied_m = script->reapplied_m,
				       .teeth = script->ghosts_teeth,
				       .eyes = script->ghosts_eyes};
	bool still = script->performance == SIM_STILL;

	face_init(&actor->face, &options, seed);
	body_init(&actor->body, still, script->reapplied_m, seed);
	motion_init(&actor->motion, script, seed);
	performance_init(&actor->performance, script, &actor->face, seconds, seed);
	actor->has_body = script->body_markers > 0;
	actor->marker_count = actor->face.marker_count + (actor->has_body ? BODY_MARKER_COUNT : 0);
}

static struct scene_marker picture_of(const struct scene_actor *actor, uint32_t m, bool dome)
{
	uint32_t face_count = actor->face.marker_count;
	struct scene_marker marker = {.exempt = -1};

	if (m < face_count) {
		const struct face_marker *on_face = &actor->face.markers[m];

		marker.reflectivity = on_face->reflectivity;
		if (on_face->on_nose)
			marker.exempt = (int)actor->first_occluder + 1;
	} else {
		marker.reflectivity = actor->body.markers[m - face_count].reflectivity;
	}
	marker.hemisphere = dome;
	marker.facing_min = dome ? DOME_FACING_MIN : DISC_FACING_MIN;
	return marker;
}

static void enter(struct sim_scene *scene, uint32_t a)
{
	const struct sim_actor_script *script = &scene->script.actors[a];
	struct scene_actor *actor = &scene->actors[a];
	struct layout *layout = &scene->layout;
	struct layout_actor *entry = &layout->actors[layout->actor_count++];

	actor->first_marker = layout->marker_count;
	*entry = (struct layout_actor){.first = actor->first_marker, .count = actor->marker_count};
	memcpy(entry->name, script->name, sizeof(entry->name));
	for (uint32_t m = 0; m < actor->marker_count; m++) {
		uint32_t label = layout->marker_count++;

		layout->markers[label] = *scene_actor_marker(actor, m);
		scene->markers[label] = picture_of(actor, m, script->hemispheres);
		scene->markers[label].actor = a;
	}
}

int scene_cast(struct sim_scene *scene, struct diag *diag)
{
	const struct sim_script *script = &scene->script;
	uint32_t occluders = 0, markers = 0;

	scene->actor_count = script->actor_count;
	for (uint32_t a = 0; a < script->actor_count; a++) {
		struct scene_actor *actor = &scene->actors[a];

		make_actor(actor, &script->actors[a], script->seconds, actor_seed(scene->seed, a));
		actor->first_occluder = occluders;
		occluders += 2 + (actor->has_body ? SEGMENT_COUNT : 0);
		markers += actor->marker_count;
	}
	if (markers > LABEL_MAX) {
		diag_add(diag,
			 "scene %s: its actors wear %u markers together, a station follows %d: "
			 "fewer on the faces",
			 script->name, markers, LABEL_MAX);
		return -EINVAL;
	}
	for (uint32_t a = 0; a < script->actor_count; a++)
		enter(scene, a);
	return happenings_init(&scene->happenings, script, scene->actors, scene->seed, diag);
}
