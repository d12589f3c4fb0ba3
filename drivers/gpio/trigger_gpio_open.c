/*
 * From an address to lines that are dark, and back.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/gpio/gpio_find.h"
#include "drivers/gpio/trigger_gpio_device.h"

#define CONSUMER "stage trigger"
#define INPUT_UNCERTAINTY_NS (20 * NS_PER_US) /* from the edge to the kernel's stamp */

static int open_outputs(struct gpio_trigger *trigger, struct gpio_chip *chip,
			const struct gpio_address *address, struct diag *diag)
{
	uint32_t offsets[PULSE_LINE_COUNT];

	for (int l = 0; l < PULSE_LINE_COUNT; l++) {
		const struct gpio_address_line *line = &address->lines[l];
		uint32_t *offset = &offsets[trigger->output_count];

		if (!*line->name)
			continue;
		int err = gpio_find_line(chip, line->name, offset, trigger->who, diag);
		if (err)
			return err;
		trigger->level_bits[l] = UINT32_C(1) << trigger->output_count++;
		trigger->dark_levels |= line->active_low ? trigger->level_bits[l] : 0;
		trigger->source.wired |= PULSE_BIT(l);
	}
	trigger->levels = trigger->dark_levels;
	if (!trigger->output_count)
		return 0;
	int err = gpio_outputs_request(&trigger->outputs, chip, CONSUMER, offsets,
				       trigger->output_count, trigger->dark_levels);
	if (err)
		diag_add(diag, "%s: cannot take its lines as outputs: %s", trigger->who,
			 strerror(-err));
	return err;
}

static int open_input(struct gpio_trigger *trigger, struct gpio_chip *chip,
		      const struct gpio_address *address, struct diag *diag)
{
	const struct gpio_address_line *line = &address->lines[GPIO_INPUT];
	uint32_t offset;

	if (!*line->name)
		return 0;
	int err = gpio_find_line(chip, line->name, &offset, trigger->who, diag);
	if (err)
		return err;
	trigger->source.paced_by_input = address->genlock;
	trigger->source.reports_exposure = !address->genlock;
	trigger->source.uncertainty_ns = INPUT_UNCERTAINTY_NS;
	err = gpio_input_request(&trigger->input, chip, CONSUMER, offset, line->active_low);
	if (err)
		diag_add(diag,
			 "%s: cannot watch line %s for edges: %s; take a line that has interrupts",
			 trigger->who, line->name, strerror(-err));
	return err;
}

void gpio_trigger_close(struct trigger *base)
{
	struct gpio_trigger *trigger = (struct gpio_trigger *)base;

	if (!trigger)
		return;
	if (trigger->outputs)
		gpio_outputs_set(trigger->outputs, trigger->dark_levels);
	trigger_guard_stop(&trigger->guard);
	gpio_outputs_release(trigger->outputs);
	gpio_input_release(trigger->input);
	free(trigger);
}

/* "trigger gpio:CHIP": how messages begin. */
static void name_trigger(char who[GPIO_WHO_BYTES], const char *rest)
{
	snprintf(who, GPIO_WHO_BYTES, "trigger gpio:%.*s",
		 (int)(strcspn(rest, ",") % GPIO_NAME_BYTES), rest);
}

int gpio_trigger_check(const char *rest, const struct trigger_plan *plan, struct diag *diag)
{
	struct gpio_address address;
	char who[GPIO_WHO_BYTES];

	(void)plan; /* lines can do any */
	name_trigger(who, rest);
	return gpio_address_parse(&address, rest, who, diag);
}

int gpio_trigger_open(struct trigger **out, const char *rest, struct diag *diag)
{
	struct gpio_trigger *trigger = calloc(1, sizeof(*trigger));
	struct gpio_address address;
	struct gpio_chip *chip;

	if (!trigger) {
		diag_add(diag, "trigger gpio: out of memory");
		return -ENOMEM;
	}
	trigger->base.driver = &gpio_trigger_driver;
	name_trigger(trigger->who, rest);
	int err = gpio_address_parse(&address, rest, trigger->who, diag);
	if (!err)
		err = gpio_find_chip(&chip, address.chip, trigger->who, diag);
	if (err) {
		free(trigger);
		return err;
	}
	err = open_outputs(trigger, chip, &address, diag);
	if (!err)
		err = open_input(trigger, chip, &address, diag);
	gpio_chip_close(chip);
	if (err) {
		gpio_trigger_close(&trigger->base);
		return err;
	}
	*out = &trigger->base;
	return 0;
}
