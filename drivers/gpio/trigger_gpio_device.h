/*
 * An open GPIO trigger, for the files of the driver.
 */
#pragma once

#include <stdatomic.h>

#include "drivers/gpio/trigger_gpio.h"
#include "drivers/gpio/trigger_guard.h"

#define GPIO_WHO_BYTES (2 * GPIO_NAME_BYTES)

struct gpio_trigger {
	struct trigger base;
	/* set when opened */
	char who[GPIO_WHO_BYTES];
	struct gpio_outputs *outputs; /* NULL: it fires nothing itself */
	struct gpio_input *input;     /* NULL: none */
	struct pulse_source source;
	uint32_t output_count;
	uint32_t level_bits[PULSE_LINE_COUNT]; /* of the wire; 0: none */
	uint32_t dark_levels;
	/* set when armed */
	struct trigger_guard guard;
	int64_t grace_ns;
	_Atomic bool armed;
	/* trigger thread */
	struct pulse_train train;
	uint32_t levels;    /* as set last */
	int64_t watched_ns; /* until when the guard leaves them */
};

/* As struct trigger_driver says. */
int gpio_trigger_check(const char *rest, const struct trigger_plan *plan, struct diag *diag);
int gpio_trigger_open(struct trigger **out, const char *rest, struct diag *diag);
void gpio_trigger_close(struct trigger *base);
