/*
 * Finds GPIO chips and lines by the names that people give them, and says what is wrong when there
 * are none such. Control thread.
 */
#pragma once

#include "base/diag.h"
#include "drivers/gpio/gpio_lines.h"
#include "drivers/trigger.h"

/* Every chip, with its lines that have names, or how many there are. Returns 0. */
int gpio_list(trigger_found_fn *found, void *user, struct diag *diag);

/* A chip by its name (gpiochip0), label (pinctrl-bcm2711) or path. `who` begins every message.
 * Returns 0, -ENODEV, -EACCES or the errno of opening it. */
int gpio_find_chip(struct gpio_chip **out, const char *wanted, const char *who, struct diag *diag);

/* A line by its name, or, where no line has it, by its number. Returns 0, -ENOENT, or -EBUSY when
 * another program has it. */
int gpio_find_line(struct gpio_chip *chip, const char *wanted, uint32_t *offset, const char *who,
		   struct diag *diag);
