/*
 * GPIO lines over libgpiod 1 (Debian 12). It talks to the kernel's first GPIO interface, whose
 * lines are set by GPIOHANDLE_SET_LINE_VALUES_IOCTL on the descriptor of the request.
 */
#include <dirent.h>
#include <errno.h>
#include <gpiod.h>
#include <linux/gpio.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/realtime.h"
#include "drivers/gpio/gpio_lines.h"
#include "drivers/gpio/gpio_wait.h"

#define EDGES_PER_READ 16 /* the most that the library hands over at once */

struct gpio_chip {
	struct gpiod_chip *lib;
};

struct gpio_outputs {
	struct gpiod_chip *lib; /* the lines are its */
	struct gpiod_line_bulk lines;
	int fd; /* borrowed */
};

struct gpio_input {
	struct gpiod_chip *lib;
	struct gpiod_line *line;
	int fd; /* borrowed */
};

const char *gpio_chip_pattern(void)
{
	return "/dev/gpiochip*";
}

int gpio_chip_open(struct gpio_chip **out, const char *path)
{
	struct gpio_chip *chip = calloc(1, sizeof(*chip));

	if (!chip)
		return -ENOMEM;
	chip->lib = gpiod_chip_open(path);
	if (!chip->lib) {
		int err = -errno;

		free(chip);
		return err;
	}
	*out = chip;
	return 0;
}

void gpio_chip_close(struct gpio_chip *chip)
{
	if (chip)
		gpiod_chip_close(chip->lib);
	free(chip);
}

const char *gpio_chip_label(struct gpio_chip *chip)
{
	return gpiod_chip_label(chip->lib);
}

uint32_t gpio_chip_line_count(struct gpio_chip *chip)
{
	return gpiod_chip_num_lines(chip->lib);
}

int gpio_chip_line(struct gpio_chip *chip, uint32_t offset, struct gpio_line_info *out)
{
	struct gpiod_line *line = gpiod_chip_get_line(chip->lib, offset);

	if (!line)
		return -errno;
	const char *name = gpiod_line_name(line), *user = gpiod_line_consumer(line);
	snprintf(out->name, sizeof(out->name), "%s", name ? name : "");
	snprintf(out->user, sizeof(out->user), "%s", user ? user : "");
	out->used = gpiod_line_is_used(line);
	return 0;
}

/* The lines of a chip die with it: whoever requests has a chip of its own. */
static struct gpiod_chip *open_again(struct gpio_chip *chip)
{
	char path[GPIO_NAME_BYTES];

	snprintf(path, sizeof(path), "/dev/%s", gpiod_chip_name(chip->lib));
	return gpiod_chip_open(path);
}

/* The library does not tell the descriptor of outputs. A program has one trigger, and nothing else
 * in it makes descriptors of this name. Returns a negative errno when there is not exactly one. */
static int find_outputs_fd(void)
{
	DIR *dir = opendir("/proc/self/fd");
	int found = -ENOTSUP;

	if (!dir)
		return -errno;
	for (struct dirent *entry; (entry = readdir(dir));) {
		char path[300], link[64] = "";

		snprintf(path, sizeof(path), "/proc/self/fd/%s", entry->d_name);
		if (readlink(path, link, sizeof(link) - 1) < 0 ||
		    strcmp(link, "anon_inode:gpio-linehandle") != 0)
			continue;
		found = found < 0 && found != -EMFILE ? atoi(entry->d_name) : -EMFILE;
	}
	closedir(dir);
	return found;
}

int gpio_line_level(struct gpio_chip *chip, uint32_t offset, const char *consumer)
{
	struct gpiod_line *line = gpiod_chip_get_line(chip->lib, offset);

	if (!line || gpiod_line_request_input(line, consumer) < 0)
		return -errno;
	int level = gpiod_line_get_value(line);
	int err = -errno;

	gpiod_line_release(line);
	return level < 0 ? err : level;
}

int gpio_outputs_request(struct gpio_outputs **out, struct gpio_chip *chip, const char *consumer,
			 const uint32_t *offsets, uint32_t count, uint32_t levels)
{
	struct gpio_outputs *outputs = calloc(1, sizeof(*outputs));
	int values[GPIO_OUTPUT_MAX], err;

	if (!outputs)
		return -ENOMEM;
	outputs->lib = open_again(chip);
	if (!outputs->lib)
		goto fail;
	gpiod_line_bulk_init(&outputs->lines);
	for (uint32_t i = 0; i < count; i++) {
		struct gpiod_line *line = gpiod_chip_get_line(outputs->lib, offsets[i]);

		if (!line)
			goto fail;
		gpiod_line_bulk_add(&outputs->lines, line);
		values[i] = (int)(levels >> i & 1);
	}
	if (gpiod_line_request_bulk_output(&outputs->lines, consumer, values) < 0)
		goto fail;
	outputs->fd = find_outputs_fd();
	if (outputs->fd < 0) {
		err = outputs->fd;
		gpio_outputs_release(outputs);
		return err;
	}
	*out = outputs;
	return 0;
fail:
	err = errno ? -errno : -ENODEV;
	if (outputs->lib)
		gpiod_chip_close(outputs->lib);
	free(outputs);
	return err;
}

void gpio_outputs_release(struct gpio_outputs *outputs)
{
	if (outputs)
		gpiod_chip_close(outputs->lib);
	free(outputs);
}

int gpio_outputs_set(struct gpio_outputs *outputs, uint32_t levels)
{
	int values[GPIO_OUTPUT_MAX];

	for (uint32_t i = 0; i < gpiod_line_bulk_num_lines(&outputs->lines); i++)
		values[i] = (int)(levels >> i & 1);
	return gpiod_line_set_value_bulk(&outputs->lines, values) < 0 ? -errno : 0;
}

int gpio_outputs_fd(const struct gpio_outputs *outputs)
{
	return outputs->fd;
}

int gpio_fd_set(int fd, uint32_t count, uint32_t levels)
{
	struct gpiohandle_data data = {0};

	for (uint32_t i = 0; i < count; i++)
		data.values[i] = levels >> i & 1;
	return ioctl(fd, GPIOHANDLE_SET_LINE_VALUES_IOCTL, &data) < 0 ? -errno : 0;
}

int gpio_input_request(struct gpio_input **out, struct gpio_chip *chip, const char *consumer,
		       uint32_t offset, bool falling)
{
	struct gpio_input *input = calloc(1, sizeof(*input));
	int err;

	if (!input)
		return -ENOMEM;
	input->lib = open_again(chip);
	if (input->lib)
		input->line = gpiod_chip_get_line(input->lib, offset);
	if (!input->line)
		goto fail;
	if ((falling ? gpiod_line_request_falling_edge_events(input->line, consumer)
		     : gpiod_line_request_rising_edge_events(input->line, consumer)) < 0)
		goto fail;
	input->fd = gpiod_line_event_get_fd(input->line);
	*out = input;
	return 0;
fail:
	err = -errno;
	gpio_input_release(input);
	return err;
}

void gpio_input_release(struct gpio_input *input)
{
	if (input && input->lib)
		gpiod_chip_close(input->lib);
	free(input);
}

int gpio_input_wait(struct gpio_input *input, int64_t until_ns)
{
	return gpio_fd_wait(input->fd, until_ns);
}

static int64_t ns_of(const struct timespec *time)
{
	return time->tv_sec * NS_PER_S + time->tv_nsec;
}

/* Kernels before 5.7 stamp with CLOCK_REALTIME. The two clocks are half a century apart, unless the
 * machine has no idea of the date: then nothing tells them apart, and nothing needs to. */
static int64_t on_monotonic(const struct timespec *stamp)
{
	struct timespec realtime;
	int64_t now_ns = clock_real_now_ns(), stamp_ns = ns_of(stamp);

	clock_gettime(CLOCK_REALTIME, &realtime);
	int64_t offset_ns = ns_of(&realtime) - now_ns;
	return llabs(stamp_ns - offset_ns - now_ns) < llabs(stamp_ns - now_ns)
		       ? stamp_ns - offset_ns
		       : stamp_ns;
}

int gpio_input_read(struct gpio_input *input, int64_t *edges_ns, int max)
{
	struct gpiod_line_event events[EDGES_PER_READ];
	int err = gpio_fd_wait(input->fd, 0);

	if (err)
		return err == -ETIMEDOUT ? 0 : err;
	bool was_in_section = realtime_pause(); /* it reads what is there */
	int count = gpiod_line_event_read_fd_multiple(
		input->fd, events, max < EDGES_PER_READ ? (unsigned)max : EDGES_PER_READ);
	err = -errno;
	realtime_resume(was_in_section);
	for (int i = 0; i < count; i++)
		edges_ns[i] = on_monotonic(&events[i].ts);
	return count < 0 ? err : count;
}
