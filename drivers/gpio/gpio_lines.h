/*
 * GPIO lines as a trigger needs them: gpio_lines_v1.c and gpio_lines_v2.c over the two APIs of
 * libgpiod, one of which meson chooses. Levels are those of the wires: what active-low means is the
 * caller's. Returns are 0 or a negative errno; -ENODEV: the chip is gone.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define GPIO_NAME_BYTES 64
#define GPIO_OUTPUT_MAX 8

struct gpio_chip;
struct gpio_outputs;
struct gpio_input;

struct gpio_line_info {
	char name[GPIO_NAME_BYTES]; /* "": it has none */
	char user[GPIO_NAME_BYTES]; /* whoever uses it, "" when nobody says */
	bool used;
};

/* Of the chips' device files, for glob(). */
const char *gpio_chip_pattern(void);

/* Control thread. -ENOTTY or -ENODEV: the file is no GPIO chip. */
int gpio_chip_open(struct gpio_chip **out, const char *path);
void gpio_chip_close(struct gpio_chip *chip); /* lines that were requested stay */
const char *gpio_chip_label(struct gpio_chip *chip);
uint32_t gpio_chip_line_count(struct gpio_chip *chip);
int gpio_chip_line(struct gpio_chip *chip, uint32_t offset, struct gpio_line_info *out);

/* The level of a line that nobody uses, 0 or 1, as it is when nobody drives it: it is an input
 * while it is asked. -EBUSY: somebody uses it. Control thread. */
int gpio_line_level(struct gpio_chip *chip, uint32_t offset, const char *consumer);

/* Lines that are set together; bit i of `levels` is the line offsets[i]. Requesting and releasing:
 * control thread. -EBUSY: another program has one of them. */
int gpio_outputs_request(struct gpio_outputs **out, struct gpio_chip *chip, const char *consumer,
			 const uint32_t *offsets, uint32_t count, uint32_t levels);
void gpio_outputs_release(struct gpio_outputs *outputs); /* accepts NULL; levels stay */

/* One system call. Any thread; real-time safe. */
int gpio_outputs_set(struct gpio_outputs *outputs, uint32_t levels);

/* For another process, which sets them with gpio_fd_set() while it holds a copy. */
int gpio_outputs_fd(const struct gpio_outputs *outputs);
int gpio_fd_set(int fd, uint32_t count, uint32_t levels);

/* A line whose edges are stamped by the kernel: rising ones, or falling ones. */
int gpio_input_request(struct gpio_input **out, struct gpio_chip *chip, const char *consumer,
		       uint32_t offset, bool falling);
void gpio_input_release(struct gpio_input *input); /* accepts NULL */

/* Until there is an edge to read: 0, or -ETIMEDOUT at `until_ns`. One thread, as the next. */
int gpio_input_wait(struct gpio_input *input, int64_t until_ns);

/* Edges that have come, CLOCK_MONOTONIC, without waiting: how many, at most `max`. */
int gpio_input_read(struct gpio_input *input, int64_t *edges_ns, int max);
