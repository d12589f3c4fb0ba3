/*
 * Chip numbers change from kernel to kernel, labels and line names do not.
 */
#include "drivers/gpio/gpio_find.h"

#include <errno.h>
#include <glob.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LIST_BYTES 600
#define LINE_COUNT_MAX 1024

/* "a, b, c", and "..." when there is no more room. */
static void append(char *list, size_t size, const char *item)
{
	size_t used = strlen(list);

	if (used + strlen(item) + 8 < size)
		snprintf(list + used, size - used, "%s%s", used ? ", " : "", item);
	else if (used > 3 && strcmp(list + used - 3, "...") != 0)
		snprintf(list + used, size - used, ", ...");
}

static const char *base_name(const char *path)
{
	const char *slash = strrchr(path, '/');

	return slash ? slash + 1 : path;
}

static bool has_label(struct gpio_chip *chip, const char *wanted)
{
	const char *label = gpio_chip_label(chip);

	return label && strcmp(label, wanted) == 0;
}

static void append_chip(char *list, size_t size, const char *path, struct gpio_chip *chip)
{
	const char *label = gpio_chip_label(chip);
	char item[2 * GPIO_NAME_BYTES];

	snprintf(item, sizeof(item), "%.60s (%.60s)", base_name(path), label ? label : "");
	append(list, size, item);
}

static void tell_missing(const char *wanted, const char *known, bool forbidden, const char *who,
			 struct diag *diag)
{
	if (forbidden)
		diag_add(diag,
			 "%s: permission denied for GPIO chip %s; chips belong to group "
			 "stage-operator by udev rule 70-stage.rules: install it and be a member",
			 who, wanted);
	else if (*known)
		diag_add(diag, "%s: no GPIO chip %s; there are %s", who, wanted, known);
	else if (access("/sys/bus/gpio", F_OK) < 0)
		diag_add(
			diag,
			"%s: no GPIO chip %s: this kernel has no GPIO; run one with CONFIG_GPIOLIB "
			"and CONFIG_GPIO_CDEV, or write another trigger",
			who, wanted);
	else
		diag_add(diag,
			 "%s: no GPIO chip %s, and no other; load its driver (lsmod, dmesg), or "
			 "write another trigger",
			 who, wanted);
}

int gpio_find_chip(struct gpio_chip **out, const char *wanted, const char *who, struct diag *diag)
{
	char known[LIST_BYTES] = "";
	bool forbidden = false;
	int err = -ENODEV;
	glob_t found;

	if (glob(gpio_chip_pattern(), 0, NULL, &found) != 0)
		memset(&found, 0, sizeof(found));
	for (size_t i = 0; i < found.gl_pathc && err; i++) {
		const char *path = found.gl_pathv[i];
		bool named = strcmp(path, wanted) == 0 || strcmp(base_name(path), wanted) == 0;
		struct gpio_chip *chip;
		int opened = gpio_chip_open(&chip, path);

		forbidden |= opened == -EACCES || opened == -EPERM;
		if (opened && named && !forbidden && opened != -ENODEV) {
			diag_add(diag, "%s: cannot open %s: %s", who, path, strerror(-opened));
			err = opened;
			break;
		}
		if (opened)
			continue;
		if (named || has_label(chip, wanted)) {
			*out = chip;
			err = 0;
			break;
		}
		append_chip(known, sizeof(known), path, chip);
		gpio_chip_close(chip);
	}
	globfree(&found);
	if (err == -ENODEV)
		tell_missing(wanted, known, forbidden, who, diag);
	return err == -ENODEV && forbidden ? -EPERM : err;
}

static uint32_t line_count(struct gpio_chip *chip)
{
	uint32_t count = gpio_chip_line_count(chip);

	return count < LINE_COUNT_MAX ? count : LINE_COUNT_MAX;
}

static bool find_by_name(struct gpio_chip *chip, const char *wanted, uint32_t *offset, char *known,
			 size_t known_bytes)
{
	struct gpio_line_info line;

	for (uint32_t i = 0; i < line_count(chip); i++) {
		if (gpio_chip_line(chip, i, &line) < 0 || !*line.name)
			continue;
		if (strcmp(line.name, wanted) == 0) {
			*offset = i;
			return true;
		}
		append(known, known_bytes, line.name);
	}
	return false;
}

static bool find_by_number(struct gpio_chip *chip, const char *wanted, uint32_t *offset)
{
	char *end;
	unsigned long number = strtoul(wanted, &end, 10);

	if (*wanted < '0' || *wanted > '9' || *end || number >= line_count(chip))
		return false;
	*offset = (uint32_t)number;
	return true;
}

int gpio_find_line(struct gpio_chip *chip, const char *wanted, uint32_t *offset, const char *who,
		   struct diag *diag)
{
	char known[LIST_BYTES] = "";
	struct gpio_line_info line = {0};
	uint32_t found;

	if (!find_by_name(chip, wanted, &found, known, sizeof(known)) &&
	    !find_by_number(chip, wanted, &found)) {
		if (*known)
			diag_add(diag, "%s: no line %s; the chip's lines are %s", who, wanted,
				 known);
		else
			diag_add(diag,
				 "%s: no line %s; the chip's lines have no names: give a number, 0 "
				 "to %u",
				 who, wanted, line_count(chip) - 1);
		return -ENOENT;
	}
	int err = gpio_chip_line(chip, found, &line);

	if (err) {
		diag_add(diag, "%s: cannot look at line %s: %s", who, wanted, strerror(-err));
		return err;
	}
	if (line.used) {
		diag_add(diag, "%s: line %s is used by %s; end that, or wire another line", who,
			 wanted, *line.user ? line.user : "somebody who gives no name");
		return -EBUSY;
	}
	*offset = found;
	return 0;
}

static void describe_lines(struct gpio_chip *chip, char *out, size_t size)
{
	for (uint32_t i = 0; i < line_count(chip); i++) {
		struct gpio_line_info line;
		char item[2 * GPIO_NAME_BYTES + 8];

		if (gpio_chip_line(chip, i, &line) < 0 || !*line.name)
			continue;
		snprintf(item, sizeof(item), line.used ? "%s (%s)" : "%s", line.name,
			 *line.user ? line.user : "used");
		append(out, size, item);
	}
	if (!*out && line_count(chip))
		snprintf(out, size, "0 to %u", line_count(chip) - 1);
}

static void describe(struct gpio_chip *chip, struct trigger_info *info)
{
	const char *label = gpio_chip_label(chip);

	snprintf(info->device, sizeof(info->device), "%.60s, %u lines", label ? label : "",
		 line_count(chip));
	describe_lines(chip, info->lines, sizeof(info->lines));
}

int gpio_list(trigger_found_fn *found, void *user, struct diag *diag)
{
	glob_t chips;

	(void)diag;
	if (glob(gpio_chip_pattern(), 0, NULL, &chips) != 0)
		memset(&chips, 0, sizeof(chips));
	for (size_t i = 0; i < chips.gl_pathc; i++) {
		struct trigger_info info = {0};
		struct gpio_chip *chip;
		int err = gpio_chip_open(&chip, chips.gl_pathv[i]);

		if (err == -ENODEV || err == -ENOTTY)
			continue;
		snprintf(info.address, sizeof(info.address), "gpio:%.100s",
			 base_name(chips.gl_pathv[i]));
		if (err)
			snprintf(info.device, sizeof(info.device), "cannot be opened: %s",
				 strerror(-err));
		else
			describe(chip, &info);
		found(&info, user);
		if (!err)
			gpio_chip_close(chip);
	}
	globfree(&chips);
	return 0;
}
