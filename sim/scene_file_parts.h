/*
 * A scene file while it is read: the script, and where each value of it stands.
 */
#pragma once

#include "config/yaml.h"
#include "sim/script.h"

#define SCENE_KEYS_MAX 24

struct scene_reading {
	struct sim_script script;
	struct yaml_place actor_places[SIM_ACTOR_MAX][SCENE_KEYS_MAX];
	struct yaml_place event_places[SIM_EVENT_MAX][SCENE_KEYS_MAX];
};

/* Readers of the keys actors and events. `target` is the scene_reading. */
void scene_read_actors(struct yaml *yaml, const struct yaml_value *value, void *target);
void scene_read_events(struct yaml *yaml, const struct yaml_value *value, void *target);
