/*
 * What a scene file may not ask for, beyond each value's own limits: actors, cameras and faults.
 * Values that could not be read are passed over, they have their message already.
 */
#include <stdio.h>
#include <string.h>

#include "sim/cameras.h"
#include "sim/face/body.h"
#include "sim/face/face.h"
#include "sim/world/scene_file_parts.h"

#define ACTORS_APART_M 0.4 /* of two heads */
#define CAMERA_CLEAR_M 0.3 /* of a camera from a head's path */
#define HEAD_WANDERS_M 0.1 /* from its seat */

struct scene_spot scene_spot(const char *list, uint32_t index, const char *key,
			     struct yaml_place place, struct yaml_place otherwise)
{
	struct scene_spot spot = {.place = place.line ? place : otherwise};

	snprintf(spot.field, sizeof(spot.field), "%s[%u].%s", list, index, key);
	return spot;
}

static struct yaml_place place_of_actor(const struct sim_actor_script *actor)
{
	return (struct yaml_place){actor->line, actor->column};
}

static struct scene_spot spot_of(const struct scene_reading *r, uint32_t index, int key,
				 const char *name)
{
	return scene_spot("actors", index, name, r->actor_places[index][key],
			  place_of_actor(&r->script.actors[index]));
}

static void check_markers(struct yaml *yaml, const struct scene_reading *r, uint32_t index)
{
	const struct sim_actor_script *actor = &r->script.actors[index];
	struct scene_spot spot = spot_of(r, index, ACTOR_FACE_MARKERS, "face_markers");
	int face = actor->face_markers, body = actor->body_markers;

	if (!face_count_known(face))
		yaml_complain(yaml, spot.place, spot.field,
			      "there is no face of %d markers: use 0, 35, 70 or 182", face);
	else if (face == 0 && body == 0)
		yaml_complain(yaml, spot.place, spot.field, "the actor wears no markers at all");
	spot = spot_of(r, index, ACTOR_BODY_MARKERS, "body_markers");
	if (body != 0 && body != BODY_MARKER_COUNT)
		yaml_complain(yaml, spot.place, spot.field,
			      "there is no body of %d markers: use 0 or 22", body);
}

static void check_neutrals(struct yaml *yaml, const struct scene_reading *r, uint32_t index)
{
	const struct sim_actor_script *actor = &r->script.actors[index];
	double neutral_s = actor->neutral_start_s + actor->neutral_end_s;
	struct scene_spot spot = spot_of(r, index, ACTOR_NEUTRAL_END, "neutral_end_s");

	if (r->script.seconds > 0 && neutral_s > r->script.seconds)
		yaml_complain(yaml, spot.place, spot.field,
			      "the neutrals take %g s of a scene of %g s", neutral_s,
			      r->script.seconds);
}

/* Compares an actor with those before it. */
static void check_alone(struct yaml *yaml, const struct scene_reading *r, uint32_t index)
{
	const struct sim_actor_script *actor = &r->script.actors[index];

	for (uint32_t i = 0; i < index; i++) {
		const struct sim_actor_script *other = &r->script.actors[i];
		double apart_m = vec3_distance(actor->seat_m, other->seat_m);
		struct scene_spot name = spot_of(r, index, ACTOR_NAME, "name");
		struct scene_spot seat = spot_of(r, index, ACTOR_SEAT, "seat_m");

		if (*actor->name && strcmp(actor->name, other->name) == 0)
			yaml_complain(yaml, name.place, name.field,
				      "'%s' is already the actor of line %d", actor->name,
				      other->line);
		if (apart_m < ACTORS_APART_M)
			yaml_complain(yaml, seat.place, seat.field,
				      "%.2f m from the actor of line %d: heads need %.1f m",
				      apart_m, other->line, ACTORS_APART_M);
	}
}

static void check_clear_of_cameras(struct yaml *yaml, const struct scene_reading *r, uint32_t index,
				   const struct sim_camera *cameras, uint32_t count)
{
	const struct sim_actor_script *actor = &r->script.actors[index];
	struct scene_spot spot = spot_of(r, index, ACTOR_SEAT, "seat_m");

	for (uint32_t c = 0; c < count; c++) {
		double apart_m = vec3_distance(actor->seat_m, cameras[c].centre_stage_m);

		if (apart_m < CAMERA_CLEAR_M + HEAD_WANDERS_M)
			yaml_complain(yaml, spot.place, spot.field,
				      "the face meets camera %s, %.2f m away: keep %.1f m",
				      cameras[c].name, apart_m, CAMERA_CLEAR_M + HEAD_WANDERS_M);
	}
}

void scene_check_actors(struct yaml *yaml, const struct scene_reading *r, uint64_t seed)
{
	const struct sim_script *script = &r->script;
	static struct sim_camera cameras[SIM_DEVICE_MAX]; /* control thread only; large */
	uint32_t count = script->camera_count + script->hd_camera_count;

	sim_cameras_init(cameras, script->camera_count, script, seed);
	sim_hd_cameras_init(cameras + script->camera_count, script->hd_camera_count, script, seed);
	for (uint32_t i = 0; i < script->actor_count; i++) {
		check_markers(yaml, r, i);
		check_neutrals(yaml, r, i);
		check_alone(yaml, r, i);
		check_clear_of_cameras(yaml, r, i, cameras, count);
	}
}

/* "ir3" or "hd0" of that many. */
static bool is_device(const char *name, const char *kind, uint32_t count)
{
	char known[NAME_BYTES];

	for (uint32_t c = 0; c < count; c++) {
		snprintf(known, sizeof(known), "%s%u", kind, c);
		if (strcmp(name, known) == 0)
			return true;
	}
	return false;
}

static void check_fault(struct yaml *yaml, const struct scene_reading *r, uint32_t index)
{
	const struct sim_script *script = &r->script;
	const struct sim_fault *fault = &script->faults.faults[index];
	struct yaml_place place = {fault->line, fault->column};
	struct scene_spot spot = scene_spot("faults", index, "camera", place, place);
	bool is_hd = is_device(fault->camera, "hd", SIM_HD_MAX);

	if (*fault->camera && !is_device(fault->camera, "ir", r->own_camera_count) &&
	    !is_device(fault->camera, "hd", r->own_hd_camera_count))
		yaml_complain(yaml, place, spot.field,
			      "there is no camera '%s': the scene has ir0 to ir%u and %u HD "
			      "cameras",
			      fault->camera, r->own_camera_count - 1, r->own_hd_camera_count);
	else if (*fault->camera)
		sim_fault_check_kind(yaml, fault, is_hd ? SIM_FAULT_OF_HD : SIM_FAULT_OF_IR,
				     spot.field);
	if (script->seconds > 0 && fault->at_s >= script->seconds)
		yaml_complain(yaml, place, scene_spot("faults", index, "at_s", place, place).field,
			      "%g s is after the scene's end at %g s", fault->at_s,
			      script->seconds);
}

void scene_check_faults(struct yaml *yaml, const struct scene_reading *r)
{
	for (uint32_t i = 0; i < r->script.faults.count; i++)
		check_fault(yaml, r, i);
}
