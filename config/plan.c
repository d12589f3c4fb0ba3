/*
 * Defaults that depend on other fields are set when all of them are read.
 */
#include "config/plan.h"

#include <stddef.h>
#include <string.h>

#include "base/clock.h"
#include "config/calibration_plan.h"

#define HD_EXPOSURE_NS (4 * NS_PER_MS)

#define HD_AT(member) offsetof(struct trigger_plan, member)

/* In the order of enum plan_field from PLAN_HD_DIVIDER on. */
static const struct yaml_key hd_keys[] = {
	{"divider", YAML_INT, HD_AT(hd_divider), .min = -1e6, .max = 1e6, .unit = "shots"},
	{"phase", YAML_INT, HD_AT(hd_phase), .min = -1e6, .max = 1e6, .unit = "shots"},
	{"delay_us", YAML_MICROS, HD_AT(hd_delay_ns), .min = 0, .max = 1e6, .unit = "microseconds"},
	{"exposure_us", YAML_MICROS, HD_AT(hd_exposure_ns), .min = 1, .max = 1e6,
	 .unit = "microseconds"},
	{0},
};

static const char *const field_names[PLAN_FIELD_COUNT] = {
	[PLAN_PERIOD] = "rate_hz",
	[PLAN_IR_DELAY] = "ir_delay_us",
	[PLAN_IR_EXPOSURE] = "exposure_us",
	[PLAN_STROBE_DELAY] = "strobe_delay_us",
	[PLAN_STROBE_WIDTH] = "strobe_width_us",
	[PLAN_STROBE_DUTY] = "strobe_duty_max",
	[PLAN_HD_DIVIDER] = "hd.divider",
	[PLAN_HD_PHASE] = "hd.phase",
	[PLAN_HD_DELAY] = "hd.delay_us",
	[PLAN_HD_EXPOSURE] = "hd.exposure_us",
};

struct trigger_plan plan_unset(void)
{
	return (struct trigger_plan){
		.period_ns = NS_PER_S / 120,
		.ir_exposure_ns = 250 * NS_PER_US,
		.strobe_duty_max = STROBE_DUTY_MAX_DEFAULT,
		.hd_divider = 4,
	};
}

void plan_read_hd(struct yaml *yaml, const struct yaml_value *value, struct trigger_plan *plan,
		  struct plan_places *places)
{
	struct yaml_place seen[sizeof(hd_keys) / sizeof(*hd_keys)];

	memset(seen, 0, sizeof(seen));
	yaml_read_mapping(yaml, value, hd_keys, plan, seen);
	memcpy(&places->fields[PLAN_HD_DIVIDER], seen, 4 * sizeof(seen[0]));
}

/* The strobe burns as long as the exposure is open, or as long as it safely can. One that was told
 * to light up after the exposure is left as it is, to be refused. */
static void set_strobe(struct trigger_plan *plan, const struct plan_places *places)
{
	if (!places->fields[PLAN_STROBE_DELAY].line)
		plan->strobe_delay_ns = plan->ir_delay_ns;
	if (places->fields[PLAN_STROBE_WIDTH].line)
		return;
	int64_t safe_ns = (int64_t)(plan->strobe_duty_max * (double)plan->period_ns);
	int64_t open_ns = plan->ir_delay_ns + plan->ir_exposure_ns - plan->strobe_delay_ns;

	if (open_ns <= 0)
		open_ns = plan->ir_exposure_ns;
	plan->strobe_width_ns = open_ns < safe_ns ? open_ns : safe_ns;
}

static void set_hd(struct trigger_plan *plan, const struct plan_places *places)
{
	int64_t half_ns = plan->period_ns * plan->hd_divider / 2;

	if (!places->fields[PLAN_HD_EXPOSURE].line)
		plan->hd_exposure_ns = HD_EXPOSURE_NS < half_ns ? HD_EXPOSURE_NS : half_ns;
}

struct complaint {
	struct yaml *yaml;
	const struct plan_places *places;
};

/* What is wrong with a default is wrong because of what is given beside it. */
static struct yaml_place place_of(const struct plan_places *places, enum plan_field field)
{
	static const enum plan_field beside[PLAN_FIELD_COUNT] = {
		[PLAN_PERIOD] = PLAN_PERIOD,
		[PLAN_IR_DELAY] = PLAN_IR_EXPOSURE,
		[PLAN_IR_EXPOSURE] = PLAN_IR_DELAY,
		[PLAN_STROBE_DELAY] = PLAN_STROBE_WIDTH,
		[PLAN_STROBE_WIDTH] = PLAN_STROBE_DELAY,
		[PLAN_STROBE_DUTY] = PLAN_STROBE_DUTY,
		[PLAN_HD_DIVIDER] = PLAN_HD_DIVIDER,
		[PLAN_HD_PHASE] = PLAN_HD_DIVIDER,
		[PLAN_HD_DELAY] = PLAN_HD_EXPOSURE,
		[PLAN_HD_EXPOSURE] = PLAN_HD_DELAY,
	};
	const struct yaml_place *fields = places->fields;

	return fields[field].line           ? fields[field]
	       : fields[beside[field]].line ? fields[beside[field]]
					    : places->otherwise;
}

static void complain(enum plan_field field, const char *text, void *user)
{
	const struct complaint *to = user;

	yaml_complain(to->yaml, place_of(to->places, field), field_names[field], "%s", text);
}

void plan_finish(struct yaml *yaml, struct trigger_plan *plan, const struct plan_places *places)
{
	struct complaint to = {yaml, places};

	set_strobe(plan, places);
	if (plan->hd_divider > 0)
		set_hd(plan, places);
	trigger_plan_problems(plan, complain, &to);
}

struct calibration_complaint {
	struct yaml *yaml;
	struct yaml_place place;
};

static void complain_of_calibration(enum plan_field field, const char *text, void *user)
{
	const struct calibration_complaint *to = user;

	(void)field;
	yaml_complain(to->yaml, to->place, "calibration", "%s", text);
}

void plan_finish_calibration(struct yaml *yaml, struct config *config, struct yaml_place place)
{
	struct calibration_complaint to = {yaml, place};

	if (yaml->failed)
		return;
	config->calibration_plan = calibration_plan(&config->calibration, &config->plan);
	trigger_plan_problems(&config->calibration_plan, complain_of_calibration, &to);
}
