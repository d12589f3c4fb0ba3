/*
 * A scene file while it is read: the script, and where each value of it stands.
 */
#pragma once

#include "config/yaml.h"
#include "sim/face/script.h"

#define SCENE_KEYS_MAX 24

/* Places of the keys in the tables of scene_actors.c and scene_events.c. */
enum {
	ACTOR_NAME,
	ACTOR_FACE_MARKERS,
	ACTOR_BODY_MARKERS,
	ACTOR_SEAT,
	ACTOR_NEUTRAL_END,
};

enum { EVENT_ACTOR = 1, EVENT_WHAT, EVENT_AT, EVENT_FOR, EVENT_AMOUNT };

struct scene_reading {
	struct sim_script script;
	uint32_t own_camera_count, own_hd_camera_count; /* as the file has them */
	struct yaml_place actor_places[SIM_ACTOR_MAX][SCENE_KEYS_MAX];
	struct yaml_place event_places[SIM_EVENT_MAX][SCENE_KEYS_MAX];
};

/* Readers of the keys actors and events. `target` is the scene_reading. */
void scene_read_actors(struct yaml *yaml, const struct yaml_value *value, void *target);
void scene_read_events(struct yaml *yaml, const struct yaml_value *value, void *target);

/* Where to point at, and the whole name of what is there. */
struct scene_spot {
	struct yaml_place place;
	char field[YAML_FIELD_BYTES];
};

/* "LIST[INDEX].KEY" at `place`, or at `otherwise` when the key is absent. */
struct scene_spot scene_spot(const char *list, uint32_t index, const char *key,
			     struct yaml_place place, struct yaml_place otherwise);

/* Once all is read. `seed` places the cameras. */
void scene_check_actors(struct yaml *yaml, const struct scene_reading *reading, uint64_t seed);
void scene_check_events(struct yaml *yaml, const struct scene_reading *reading);
void scene_check_faults(struct yaml *yaml, const struct scene_reading *reading);
