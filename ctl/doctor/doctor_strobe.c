/*
 * Whether the strobe goes dark when everything else fails. Its hardware cannot be asked: what the
 * operator has confirmed in the config is held against the plan, and the rest is asked for.
 */
#include <inttypes.h>
#include <string.h>

#include "base/clock.h"
#include "ctl/doctor/doctor.h"
#include "drivers/gpio/gpio_find.h"
#include "drivers/gpio/trigger_gpio.h"

/* One that can burn: a driver without devices, as the simulator's, fires none. */
static bool has_strobe(const struct doctor *doctor)
{
	const char *rest;
	const struct trigger_driver *driver = doctor_trigger(doctor, &rest);

	return doctor->config->plan.strobe_width_ns > 0 && driver && driver->list &&
	       driver->fires && driver->fires(rest) & TRIGGER_FIRES_STROBE;
}

/* A config whose strobe burns for longer is refused before. */
static void show_duty(struct doctor *doctor)
{
	const struct trigger_plan *plan = &doctor->config->plan;
	double duty = (double)plan->strobe_width_ns / (double)plan->period_ns;
	struct finding *finding = doctor_find(doctor, FINDING_OK, "strobe's duty");

	doctor_say(finding->measured, "%.0f us of each %.0f us: %.1f %%",
		   (double)plan->strobe_width_ns / NS_PER_US, (double)plan->period_ns / NS_PER_US,
		   100 * duty);
	doctor_say(finding->limit, "strobe_duty_max %.1f %%", 100 * plan->strobe_duty_max);
}

static void ask_for_one_shot(struct doctor *doctor)
{
	const struct trigger_plan *plan = &doctor->config->plan;
	struct finding *finding = doctor_find(doctor, FINDING_NOTE, "strobe's one-shot");

	doctor_say(finding->measured, "not confirmed, and no program can see it");
	doctor_say(finding->limit, "ends each pulse by itself, after %.0f to %.0f us",
		   (double)plan->strobe_width_ns / NS_PER_US,
		   plan->strobe_duty_max * (double)plan->period_ns / NS_PER_US);
	doctor_say(finding->remedy, "hold the strobe's input lit by hand: it must go dark at once; "
				    "then write strobe_one_shot_us: N into the config");
}

/* Longer than a pulse of the plan, no longer than the strobe survives in every period. */
static void check_one_shot(struct doctor *doctor)
{
	const struct config *config = doctor->config;
	const struct trigger_plan *plan = &config->plan;
	int64_t one_shot_ns = config->strobe_one_shot_ns;

	if (!one_shot_ns) {
		ask_for_one_shot(doctor);
		return;
	}
	double safe_ns = plan->strobe_duty_max * (double)plan->period_ns;
	bool cuts = one_shot_ns<plan->strobe_width_ns, burns = (double)one_shot_ns> safe_ns;
	struct finding *finding = doctor_find(doctor, cuts || burns ? FINDING_PROBLEM : FINDING_OK,
					      "strobe's one-shot");

	doctor_say(finding->measured, "%.0f us, as the config says",
		   (double)one_shot_ns / NS_PER_US);
	doctor_say(finding->limit, "%.0f to %.0f us", (double)plan->strobe_width_ns / NS_PER_US,
		   safe_ns / NS_PER_US);
	if (cuts)
		doctor_say(finding->remedy, "it cuts pulses short: set it longer, or "
					    "strobe_width_us shorter");
	else if (burns)
		doctor_say(finding->remedy, "a line that stays lit at this rate burns the strobe: "
					    "set it shorter");
}

static void check_pull_down(struct doctor *doctor)
{
	bool said = doctor->config->strobe_pull_down;
	struct finding *finding =
		doctor_find(doctor, said ? FINDING_OK : FINDING_NOTE, "strobe's pull-down");

	doctor_say(finding->measured, said ? "there is one, as the config says" : "not confirmed");
	if (!said)
		doctor_say(finding->remedy,
			   "pull the trigger's plug while the strobe has power: it must stay dark, "
			   "also while this machine boots; then write strobe_pull_down: true into "
			   "the config");
}

/* -EBUSY and what else there is: told by `diag`, or the level. */
static int read_level(const struct gpio_address *address, struct diag *diag)
{
	struct gpio_chip *chip;
	uint32_t offset;
	int err = gpio_find_chip(&chip, address->chip, "strobe", diag);

	if (err)
		return err;
	err = gpio_find_line(chip, address->lines[PULSE_STROBE].name, &offset, "strobe", diag);
	if (!err)
		err = gpio_line_level(chip, offset, "stage-doctor");
	gpio_chip_close(chip);
	return err;
}

static void say_unread(struct finding *finding, const struct diag *diag, int err)
{
	const char *why = diag->text ? diag->text : strerror(-err);

	finding->level = FINDING_NOTE;
	doctor_say(finding->measured, "not read: %.*s", (int)strcspn(why, "\n"), why);
	doctor_say(finding->remedy, "ask again when the chip is there and no station runs");
}

/* The wire itself, while nobody drives it. */
static void check_level(struct doctor *doctor)
{
	struct gpio_address address;
	struct diag diag = {0};
	const char *rest;

	if (doctor_trigger(doctor, &rest) != &gpio_trigger_driver ||
	    gpio_address_parse(&address, rest, "strobe", NULL))
		return;
	const struct gpio_address_line *line = &address.lines[PULSE_STROBE];
	int level = read_level(&address, &diag);
	struct finding *finding =
		doctor_find(doctor, FINDING_OK, "line %s, driven by nobody", line->name);

	if (level < 0) {
		say_unread(finding, &diag, level);
	} else {
		doctor_say(finding->measured, "reads %s",
			   level != line->active_low ? "lit" : "dark");
		doctor_say(finding->limit, "dark");
	}
	if (level >= 0 && level != line->active_low) {
		finding->level = FINDING_PROBLEM;
		doctor_say(finding->remedy,
			   "the strobe burns whenever the station does not run: a resistor of 1 to "
			   "10 kOhm from the line to %s",
			   line->active_low ? "the supply" : "ground");
	}
	diag_finish(&diag);
}

void doctor_check_strobe(struct doctor *doctor)
{
	if (!doctor->config)
		return;
	if (!has_strobe(doctor)) {
		struct finding *finding = doctor_find(doctor, FINDING_OK, "strobe");

		doctor_say(finding->measured, "none is driven by this machine");
		return;
	}
	show_duty(doctor);
	check_one_shot(doctor);
	check_pull_down(doctor);
	check_level(doctor);
}
