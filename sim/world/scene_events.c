/*
 * The list of events of a scene file.
 */
#include <stddef.h>

#include "sim/world/scene_file_parts.h"

#define AT(member) offsetof(struct sim_event, member)

static const char *const kinds[] = {
	[SIM_EVENT_EXPRESSION] = "expression",
	[SIM_EVENT_FALL_OFF] = "fall_off",
	[SIM_EVENT_HAND] = "hand",
	[SIM_EVENT_PASSER] = "passer",
	[SIM_EVENT_JIG_SLIP] = "jig_slip",
	[SIM_EVENT_TURN] = "turn",
	[SIM_EVENT_MICRO] = "micro",
	NULL,
};

static const struct yaml_key event_keys[] = {
	{"kind", YAML_CHOICE, AT(kind), true, .choices = kinds},
	{"actor", YAML_NAME, AT(actor), .size = NAME_BYTES},
	{"what", YAML_NAME, AT(what), .size = NAME_BYTES},
	{"at_s", YAML_DOUBLE, AT(at_s), true, .min = 0, .max = 1e6, .unit = "seconds"},
	{"for_s", YAML_DOUBLE, AT(for_s), .min = 0, .max = 1e6, .unit = "seconds"},
	{"amount", YAML_DOUBLE, AT(amount), .min = -180, .max = 180},
	{0},
};

_Static_assert(sizeof(event_keys) / sizeof(*event_keys) <= SCENE_KEYS_MAX, "room for places");

static void read_event(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct scene_reading *reading = target;
	uint32_t index = reading->script.event_count++;
	struct sim_event *event = &reading->script.events[index];

	*event = (struct sim_event){
		.kind = -1, .line = value->place.line, .column = value->place.column};
	yaml_read_mapping(yaml, value, event_keys, event, reading->event_places[index]);
}

void scene_read_events(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	yaml_read_list(yaml, value, SIM_EVENT_MAX, "events", read_event, target);
}
