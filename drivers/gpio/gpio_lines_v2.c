/*
 * GPIO lines over libgpiod 2 (Debian 13), which talks to the kernel's second GPIO interface.
 */
#include <errno.h>
#include <gpiod.h>
#include <linux/gpio.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>

#include "base/clock.h"
#include "base/realtime.h"
#include "drivers/gpio/gpio_lines.h"
#include "drivers/gpio/gpio_wait.h"

#define EDGES_PER_READ 16

struct gpio_chip {
	struct gpiod_chip *lib;
	struct gpiod_chip_info *info;
};

struct gpio_outputs {
	struct gpiod_line_request *lib;
	uint32_t count;
};

struct gpio_input {
	struct gpiod_line_request *lib;
	struct gpiod_edge_event_buffer *events;
};

const char *gpio_chip_pattern(void)
{
	return "/dev/gpiochip*";
}

int gpio_chip_open(struct gpio_chip **out, const char *path)
{
	struct gpio_chip *chip = calloc(1, sizeof(*chip));
	int err;

	if (!chip)
		return -ENOMEM;
	chip->lib = gpiod_chip_open(path);
	if (chip->lib)
		chip->info = gpiod_chip_get_info(chip->lib);
	if (!chip->info) {
		err = -errno;
		gpio_chip_close(chip);
		return err;
	}
	*out = chip;
	return 0;
}

void gpio_chip_close(struct gpio_chip *chip)
{
	if (chip && chip->info)
		gpiod_chip_info_free(chip->info);
	if (chip && chip->lib)
		gpiod_chip_close(chip->lib);
	free(chip);
}

const char *gpio_chip_label(struct gpio_chip *chip)
{
	return gpiod_chip_info_get_label(chip->info);
}

uint32_t gpio_chip_line_count(struct gpio_chip *chip)
{
	return (uint32_t)gpiod_chip_info_get_num_lines(chip->info);
}

int gpio_chip_line(struct gpio_chip *chip, uint32_t offset, struct gpio_line_info *out)
{
	struct gpiod_line_info *info = gpiod_chip_get_line_info(chip->lib, offset);

	if (!info)
		return -errno;
	const char *name = gpiod_line_info_get_name(info);
	const char *user = gpiod_line_info_get_consumer(info);
	snprintf(out->name, sizeof(out->name), "%s", name ? name : "");
	snprintf(out->user, sizeof(out->user), "%s", user ? user : "");
	out->used = gpiod_line_info_is_used(info);
	gpiod_line_info_free(info);
	return 0;
}

static enum gpiod_line_value value_of(uint32_t levels, uint32_t line)
{
	return levels >> line & 1 ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
}

/* `values` is NULL for inputs. NULL, with errno, on failure. */
static struct gpiod_line_request *request(struct gpio_chip *chip, const char *consumer,
					  const uint32_t *offsets, uint32_t count,
					  struct gpiod_line_settings *settings,
					  const enum gpiod_line_value *values)
{
	struct gpiod_request_config *who = gpiod_request_config_new();
	struct gpiod_line_config *lines = gpiod_line_config_new();
	struct gpiod_line_request *made = NULL;

	if (!who || !lines || !settings)
		goto done;
	gpiod_request_config_set_consumer(who, consumer);
	if (gpiod_line_config_add_line_settings(lines, offsets, count, settings) < 0 ||
	    (values && gpiod_line_config_set_output_values(lines, values, count) < 0))
		goto done;
	made = gpiod_chip_request_lines(chip->lib, who, lines);
done:;
	int err = errno;
	gpiod_line_config_free(lines);
	gpiod_request_config_free(who);
	errno = err;
	return made;
}

int gpio_line_level(struct gpio_chip *chip, uint32_t offset, const char *consumer)
{
	struct gpiod_line_settings *settings = gpiod_line_settings_new();

	if (!settings)
		return -ENOMEM;
	gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_INPUT);
	struct gpiod_line_request *made = request(chip, consumer, &offset, 1, settings, NULL);
	enum gpiod_line_value level =
		made ? gpiod_line_request_get_value(made, offset) : GPIOD_LINE_VALUE_ERROR;
	int err = -errno;

	gpiod_line_settings_free(settings);
	if (made)
		gpiod_line_request_release(made);
	if (level == GPIOD_LINE_VALUE_ERROR)
		return err;
	return level == GPIOD_LINE_VALUE_ACTIVE;
}

int gpio_outputs_request(struct gpio_outputs **out, struct gpio_chip *chip, const char *consumer,
			 const uint32_t *offsets, uint32_t count, uint32_t levels)
{
	struct gpiod_line_settings *settings = gpiod_line_settings_new();
	struct gpio_outputs *outputs = calloc(1, sizeof(*outputs));
	enum gpiod_line_value values[GPIO_OUTPUT_MAX];
	int err = -ENOMEM;

	if (!settings || !outputs)
		goto fail;
	gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_OUTPUT);
	for (uint32_t i = 0; i < count; i++)
		values[i] = value_of(levels, i);
	outputs->lib = request(chip, consumer, offsets, count, settings, values);
	err = -errno;
	if (!outputs->lib)
		goto fail;
	gpiod_line_settings_free(settings);
	outputs->count = count;
	*out = outputs;
	return 0;
fail:
	gpiod_line_settings_free(settings);
	free(outputs);
	return err;
}

void gpio_outputs_release(struct gpio_outputs *outputs)
{
	if (outputs)
		gpiod_line_request_release(outputs->lib);
	free(outputs);
}

int gpio_outputs_set(struct gpio_outputs *outputs, uint32_t levels)
{
	enum gpiod_line_value values[GPIO_OUTPUT_MAX];

	for (uint32_t i = 0; i < outputs->count; i++)
		values[i] = value_of(levels, i);
	return gpiod_line_request_set_values(outputs->lib, values) < 0 ? -errno : 0;
}

int gpio_outputs_fd(const struct gpio_outputs *outputs)
{
	return gpiod_line_request_get_fd(outputs->lib);
}

int gpio_fd_set(int fd, uint32_t count, uint32_t levels)
{
	struct gpio_v2_line_values values = {.bits = levels, .mask = (UINT64_C(1) << count) - 1};

	return ioctl(fd, GPIO_V2_LINE_SET_VALUES_IOCTL, &values) < 0 ? -errno : 0;
}

int gpio_input_request(struct gpio_input **out, struct gpio_chip *chip, const char *consumer,
		       uint32_t offset, bool falling)
{
	struct gpiod_line_settings *settings = gpiod_line_settings_new();
	struct gpio_input *input = calloc(1, sizeof(*input));
	int err = -ENOMEM;

	if (!settings || !input)
		goto fail;
	gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_INPUT);
	gpiod_line_settings_set_edge_detection(settings, falling ? GPIOD_LINE_EDGE_FALLING
								 : GPIOD_LINE_EDGE_RISING);
	gpiod_line_settings_set_event_clock(settings, GPIOD_LINE_CLOCK_MONOTONIC);
	input->events = gpiod_edge_event_buffer_new(EDGES_PER_READ);
	if (!input->events)
		goto fail;
	input->lib = request(chip, consumer, &offset, 1, settings, NULL);
	err = -errno;
	if (!input->lib)
		goto fail;
	gpiod_line_settings_free(settings);
	*out = input;
	return 0;
fail:
	gpiod_line_settings_free(settings);
	gpio_input_release(input);
	return err;
}

void gpio_input_release(struct gpio_input *input)
{
	if (input && input->lib)
		gpiod_line_request_release(input->lib);
	if (input)
		gpiod_edge_event_buffer_free(input->events);
	free(input);
}

int gpio_input_wait(struct gpio_input *input, int64_t until_ns)
{
	return gpio_fd_wait(gpiod_line_request_get_fd(input->lib), until_ns);
}

int gpio_input_read(struct gpio_input *input, int64_t *edges_ns, int max)
{
	int err = gpio_input_wait(input, 0);

	if (err)
		return err == -ETIMEDOUT ? 0 : err;
	bool was_in_section = realtime_pause(); /* it reads what is there */
	int count = gpiod_line_request_read_edge_events(
		input->lib, input->events, (size_t)(max < EDGES_PER_READ ? max : EDGES_PER_READ));
	err = -errno;
	realtime_resume(was_in_section);
	for (int i = 0; i < count; i++)
		edges_ns[i] = (int64_t)gpiod_edge_event_get_timestamp_ns(
			gpiod_edge_event_buffer_get_event(input->events, (unsigned long)i));
	return count < 0 ? err : count;
}
