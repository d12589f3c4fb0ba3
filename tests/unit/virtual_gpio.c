#include "virtual_gpio.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/clock_virtual.h"
#include "drivers/gpio/trigger_gpio.h"
#include "tests/gpio/fake_guard.h"

char gpio_dir[] = "/tmp/stage-gpio-XXXXXX";
struct fake_gpio *chip;
struct trigger *trigger;
struct diag diag;

int virtual_gpio_create(void **state)
{
	(void)state;
	return mkdtemp(gpio_dir) ? setenv(FAKE_GPIO_DIR_ENV, gpio_dir, 1) : -1;
}

int virtual_gpio_destroy(void **state)
{
	char path[64];

	(void)state;
	snprintf(path, sizeof(path), "%s/gpiochip0", gpio_dir);
	unlink(path);
	return rmdir(gpio_dir);
}

int virtual_gpio_begin(void **state)
{
	(void)state;
	chip = fake_gpio_create(gpio_dir, "gpiochip0");
	memset(&fake_guard, 0, sizeof(fake_guard));
	clock_virtual_begin(NS_PER_S, CLOCK_NO_LIMIT);
	clock_thread_expect();
	clock_thread_begin();
	trigger = NULL;
	return 0;
}

int virtual_gpio_end(void **state)
{
	(void)state;
	gpio_trigger_driver.close(trigger);
	clock_thread_end();
	clock_virtual_end();
	diag_finish(&diag);
	return 0;
}

int open_lines(const char *lines)
{
	return gpio_trigger_driver.open(&trigger, lines, &diag);
}

void arm_lines(const char *lines, const struct trigger_plan *plan)
{
	if (open_lines(lines) < 0 || gpio_trigger_driver.arm(trigger, plan, &diag) < 0)
		fail_msg("%s", diag.text);
	atomic_store(&chip->change_count, 0);
}

int next_edge(struct edge *edge)
{
	int err;

	do
		err = gpio_trigger_driver.next(trigger, 100 * NS_PER_MS, edge);
	while (err == -ETIMEDOUT);
	return err;
}

struct edge take_edge(void)
{
	struct edge edge;

	assert_int_equal(next_edge(&edge), 0);
	return edge;
}

void take_edges(int count)
{
	for (int i = 0; i < count; i++)
		take_edge();
}

int burns_of(uint32_t bit, uint32_t dark_levels, struct burn *burns)
{
	uint32_t was = dark_levels;
	int count = 0;

	for (uint32_t i = 0; i < chip->change_count; i++) {
		const struct fake_gpio_change *change = &chip->changes[i];
		uint32_t turned = (was ^ change->levels) & bit;

		was = change->levels;
		if (!turned)
			continue;
		if ((change->levels ^ dark_levels) & bit) {
			assert_true(count < BURNS_MAX);
			burns[count] = (struct burn){change->time_ns, INT64_MAX};
		} else {
			burns[count++].off_ns = change->time_ns;
		}
	}
	return count;
}

int64_t burn_max_ns(const struct trigger_plan *plan)
{
	return (int64_t)(plan->strobe_duty_max * (double)plan->period_ns) + 100 * NS_PER_US;
}

void check_duty(const struct burn *burns, int count, const struct trigger_plan *plan)
{
	for (int a = 0; a < count; a++) {
		double burnt_ns = 0;

		for (int b = a; b < count && b < a + 60; b++) {
			double passed_ns = (double)(burns[b].off_ns - burns[a].on_ns);

			burnt_ns += (double)(burns[b].off_ns - burns[b].on_ns);
			assert_true(burnt_ns <=
				    plan->strobe_duty_max * passed_ns + (double)burn_max_ns(plan));
		}
	}
}
