/*
 * The trigger plan's part of the configuration: its keys' defaults, and its rules told with lines
 * and columns.
 */
#pragma once

#include "config/config.h"
#include "config/yaml.h"
#include "drivers/trigger_plan.h"

/* Where the file gives each field of the plan; line 0 = it does not. */
struct plan_places {
	struct yaml_place fields[PLAN_FIELD_COUNT];
	struct yaml_place otherwise; /* of a field that is not given: the file's beginning */
};

/* A plan in which what the file may leave out is not yet set. */
struct trigger_plan plan_unset(void);

/* Key `hd`. */
void plan_read_hd(struct yaml *yaml, const struct yaml_value *value, struct trigger_plan *plan,
		  struct plan_places *places);

/* Sets what the file left out and complains about a plan that cannot be. */
void plan_finish(struct yaml *yaml, struct trigger_plan *plan, const struct plan_places *places);

/* Makes the plan of a calibration, or complains at `place`. Not when the file is wrong already. */
void plan_finish_calibration(struct yaml *yaml, struct config *config, struct yaml_place place);
