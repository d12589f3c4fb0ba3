/*
 * Trigger `gpio`: pulses on GPIO lines, by the kernel's clock on the trigger thread. Its address is
 *
 *     gpio:CHIP,ir=LINE,strobe=LINE,hd=LINE,exposure=LINE
 *
 * with any of these lines, or genlock=LINE in place of exposure; !LINE is active low.
 */
#pragma once

#include "drivers/gpio/gpio_lines.h"
#include "drivers/gpio/pulse_train.h"

#define GPIO_INPUT PULSE_LINE_COUNT /* behind the outputs, which stand by enum pulse_line */

struct gpio_address {
	char chip[GPIO_NAME_BYTES];
	struct gpio_address_line {
		char name[GPIO_NAME_BYTES]; /* "": not wired */
		bool active_low;
	} lines[PULSE_LINE_COUNT + 1];
	bool genlock; /* the input paces the shots; else it tells when a camera exposes */
};

/* Returns 0 or -EINVAL with a message that begins with `who`. */
int gpio_address_parse(struct gpio_address *out, const char *rest, const char *who,
		       struct diag *diag);

/* trigger_driver.fires() */
uint32_t gpio_address_fires(const char *rest);

extern const struct trigger_driver gpio_trigger_driver;
