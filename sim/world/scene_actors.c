/*
 * The list of actors of a scene file.
 */
#include <stddef.h>

#include "sim/world/scene_file_parts.h"

#define AT(member) offsetof(struct sim_actor_script, member)
#define SPEED(member) YAML_DOUBLE, AT(member), .min = 0, .max = 3, .unit = "metres a second"

static const char *const performances[] = {"still",   "talking",         "turning",
					   "shaking", "range_of_motion", NULL};

static void read_seat(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	static const struct yaml_key coordinate = {"seat_m", YAML_DOUBLE, .min = -20, .max = 20,
						   .unit = "metres"};
	struct sim_actor_script *actor = target;
	double p[3];

	if (yaml_read_numbers(yaml, value, &coordinate, p, 3))
		actor->seat_m = (struct vec3){p[0], p[1], p[2]};
}

static const struct yaml_key actor_keys[] = {
	{"name", YAML_NAME, AT(name), true, .size = NAME_BYTES},
	{"face_markers", YAML_INT, AT(face_markers), .min = 0, .max = 182, .unit = "markers"},
	{"body_markers", YAML_INT, AT(body_markers), .min = 0, .max = 22, .unit = "markers"},
	{"seat_m", YAML_CUSTOM, .read = read_seat},
	{"neutral_end_s", YAML_DOUBLE, AT(neutral_end_s), .min = 0, .max = 60, .unit = "seconds"},
	{"face_diameter_m", YAML_DOUBLE, AT(face_diameter_m), .min = 0.0005, .max = 0.01,
	 .unit = "metres"},
	{"hemispheres", YAML_BOOL, .offset = AT(hemispheres)},
	{"facing_deg", YAML_DOUBLE, AT(facing_deg), .min = -360, .max = 360, .unit = "degrees"},
	{"performance", YAML_CHOICE, AT(performance), .choices = performances},
	{"face_speed_m_s", SPEED(face_speed_m_s)},
	{"shake_speed_m_s", SPEED(shake_speed_m_s)},
	{"neutral_start_s", YAML_DOUBLE, AT(neutral_start_s), .min = 0, .max = 60,
	 .unit = "seconds"},
	{"reapplied_m", YAML_DOUBLE, AT(reapplied_m), .min = 0, .max = 0.01, .unit = "metres"},
	{"ghosts_teeth", YAML_BOOL, .offset = AT(ghosts_teeth)},
	{"ghosts_eyes", YAML_BOOL, .offset = AT(ghosts_eyes)},
	{0},
};

_Static_assert(sizeof(actor_keys) / sizeof(*actor_keys) <= SCENE_KEYS_MAX, "room for places");

static void read_actor(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct scene_reading *reading = target;
	uint32_t index = reading->script.actor_count++;
	struct sim_actor_script *actor = &reading->script.actors[index];

	*actor = (struct sim_actor_script){.face_markers = 70,
					   .seat_m = {0, 0, 1.2},
					   .performance = SIM_TALKING,
					   .face_speed_m_s = 0.4,
					   .shake_speed_m_s = 0.3,
					   .line = value->place.line,
					   .column = value->place.column};
	yaml_read_mapping(yaml, value, actor_keys, actor, reading->actor_places[index]);
}

void scene_read_actors(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	yaml_read_list(yaml, value, SIM_ACTOR_MAX, "actors", read_actor, target);
}
