/*
 * Reads the address of a GPIO trigger.
 */
#include <errno.h>
#include <string.h>

#include "drivers/gpio/trigger_gpio.h"

#define FORM "gpio:CHIP,ir=LINE,strobe=LINE,hd=LINE,exposure=LINE or genlock=LINE"

static const struct {
	const char *key;
	int line;
	bool genlock;
} keys[] = {
	{"ir", PULSE_IR, false},         {"strobe", PULSE_STROBE, false}, {"hd", PULSE_HD, false},
	{"exposure", GPIO_INPUT, false}, {"genlock", GPIO_INPUT, true},
};

#define KEY_COUNT (sizeof(keys) / sizeof(keys[0]))

/* The next part up to a comma into `part`; false when there is none, or it is too long. */
static bool take_part(const char **rest, char *part, size_t size)
{
	size_t length = strcspn(*rest, ",");

	if (length == 0 || length >= size)
		return false;
	memcpy(part, *rest, length);
	part[length] = 0;
	*rest += length + ((*rest)[length] == ',');
	return true;
}

static int set_line(struct gpio_address *address, const char *key, const char *name,
		    const char *who, struct diag *diag)
{
	for (size_t k = 0; k < KEY_COUNT; k++) {
		struct gpio_address_line *line = &address->lines[keys[k].line];

		if (strcmp(keys[k].key, key) != 0)
			continue;
		if (*line->name) {
			diag_add(diag, "%s: %s=%s: its line is already %s", who, key, name,
				 line->name);
			return -EINVAL;
		}
		line->active_low = *name == '!';
		snprintf(line->name, sizeof(line->name), "%s", name + line->active_low);
		address->genlock |= keys[k].genlock;
		return 0;
	}
	diag_add(diag, "%s: '%s' is none of ir, strobe, hd, exposure and genlock", who, key);
	return -EINVAL;
}

static int read_line(struct gpio_address *address, char *part, const char *who, struct diag *diag)
{
	char *equals = strchr(part, '=');

	if (!equals || !equals[1] || strcmp(equals, "=!") == 0 ||
	    strlen(equals) > GPIO_NAME_BYTES) {
		diag_add(diag, "%s: '%s' does not name a line; write " FORM, who, part);
		return -EINVAL;
	}
	*equals = 0;
	return set_line(address, part, equals + 1, who, diag);
}

static int check_lines(const struct gpio_address *address, const char *who, struct diag *diag)
{
	int wired = 0;

	for (int a = 0; a <= GPIO_INPUT; a++) {
		const char *name = address->lines[a].name;

		wired += *name && (a != GPIO_INPUT || address->genlock);
		for (int b = 0; b < a && *name; b++)
			if (strcmp(name, address->lines[b].name) == 0) {
				diag_add(diag, "%s: line %s cannot be two things", who, name);
				return -EINVAL;
			}
	}
	if (wired == 0)
		diag_add(diag, "%s: no line to fire; write " FORM, who);
	return wired ? 0 : -EINVAL;
}

int gpio_address_parse(struct gpio_address *out, const char *rest, const char *who,
		       struct diag *diag)
{
	struct gpio_address address = {0};
	char part[2 * GPIO_NAME_BYTES];

	if (!take_part(&rest, address.chip, sizeof(address.chip)) || strchr(address.chip, '=')) {
		diag_add(diag, "%s: no chip named; write " FORM, who);
		return -EINVAL;
	}
	while (*rest) {
		if (!take_part(&rest, part, sizeof(part))) {
			diag_add(diag, "%s: an empty or endless name; write " FORM, who);
			return -EINVAL;
		}
		int err = read_line(&address, part, who, diag);
		if (err)
			return err;
	}
	int err = check_lines(&address, who, diag);
	if (!err)
		*out = address;
	return err;
}

/* Of a genlock whose pulses a line follows, or none does: what exposes the IR cameras is one of the
 * two. Its source reaches HD cameras too when nothing here does. */
uint32_t gpio_address_fires(const char *rest)
{
	struct gpio_address address;

	if (gpio_address_parse(&address, rest, "", NULL))
		return 0;
	bool ir = *address.lines[PULSE_IR].name, strobe = *address.lines[PULSE_STROBE].name,
	     hd = *address.lines[PULSE_HD].name;
	bool source_alone = address.genlock && !ir && !strobe && !hd;

	return (ir || address.genlock ? TRIGGER_FIRES_IR : 0) |
	       (strobe ? TRIGGER_FIRES_STROBE : 0) | (hd || source_alone ? TRIGGER_FIRES_HD : 0);
}
