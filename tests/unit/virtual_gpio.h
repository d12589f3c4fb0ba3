/*
 * A GPIO trigger in virtual time, on a chip that is a file, with a guard that writes down what it
 * is told.
 */
#pragma once

#include "drivers/trigger.h"
#include "tests/gpio/fake_gpio.h"

#define GPIO_LINES "gpiochip0,ir=IR_TRIG,strobe=STROBE,hd=HD_TRIG"
#define IR 1U
#define STROBE 2U
#define HD 4U
#define BURNS_MAX 4096

extern char gpio_dir[]; /* its files are the chips */
extern struct fake_gpio *chip;
extern struct trigger *trigger; /* NULL until it is open */
extern struct diag diag;

/* Before and after all tests of a program. */
int virtual_gpio_create(void **state);
int virtual_gpio_destroy(void **state);

/* Before and after each: time begins, no trigger is open. */
int virtual_gpio_begin(void **state);
int virtual_gpio_end(void **state);

int open_lines(const char *lines);

/* Opens and arms; what the lines did so far is forgotten. */
void arm_lines(const char *lines, const struct trigger_plan *plan);

/* The next edge, whenever it comes, or what ended the waiting. */
int next_edge(struct edge *edge);
struct edge take_edge(void);
void take_edges(int count);

/* A pulse of one line, as the wire had it. */
struct burn {
	int64_t on_ns, off_ns; /* INT64_MAX while it burns */
};

/* Those of a line since it was armed. Returns how many; at most BURNS_MAX. */
int burns_of(uint32_t bit, uint32_t dark_levels, struct burn *burns);

/* What one burn may last at the worst. */
int64_t burn_max_ns(const struct trigger_plan *plan);

/* The strobe's share of any stretch of time is kept, but for one burn. */
void check_duty(const struct burn *burns, int count, const struct trigger_plan *plan);
