/*
 * What a trigger plan must keep to, said once: the config asks with its lines and columns, every
 * trigger asks again when it is armed. And the times that follow from a plan.
 */
#pragma once

#include "base/diag.h"
#include "drivers/trigger.h"

/* Overdriven strobe LEDs survive a tenth of the time lit; a plan that sets no limit has this. */
#define STROBE_DUTY_MAX_DEFAULT 0.1

enum plan_field {
	PLAN_PERIOD,
	PLAN_IR_DELAY,
	PLAN_IR_EXPOSURE,
	PLAN_STROBE_DELAY,
	PLAN_STROBE_WIDTH,
	PLAN_STROBE_DUTY,
	PLAN_HD_DIVIDER,
	PLAN_HD_PHASE,
	PLAN_HD_DELAY,
	PLAN_HD_EXPOSURE,
	PLAN_FIELD_COUNT,
};

/* One thing that cannot be, and what to do about it. */
typedef void plan_problem_fn(enum plan_field field, const char *text, void *user);

/* Calls `problem` for everything that is wrong with the plan. Returns 0 or -EINVAL. Any thread. */
int trigger_plan_problems(const struct trigger_plan *plan, plan_problem_fn *problem, void *user);

/* The same into `diag`, one message per problem that begins with "trigger WHO: ". For arm(). */
int trigger_plan_check(const struct trigger_plan *plan, const char *who, struct diag *diag);

/* From a shot's edge to the middle of the time in which IR light is collected: the overlap of
 * exposure and strobe, or the exposure alone when no strobe is planned. */
int64_t trigger_plan_ir_middle_ns(const struct trigger_plan *plan);

/* The same of the HD cameras: the middle of their exposure. */
int64_t trigger_plan_hd_middle_ns(const struct trigger_plan *plan);
