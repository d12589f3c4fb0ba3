/*
 * Addresses of the GPIO trigger: chips and lines by every name that they have, and what cannot be
 * is refused with the reason.
 */
#include "drivers/gpio/trigger_gpio.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "usual_plan.h"
#include "virtual_gpio.h"

static void addresses_that_cannot_be_are_refused_with_a_reason(void **state)
{
	static const struct {
		const char *rest, *said;
		int err;
	} cases[] = {
		{"", "no chip named", -EINVAL},
		{"ir=IR_TRIG", "no chip named", -EINVAL},
		{"gpiochip0", "no line to fire", -EINVAL},
		{"gpiochip0,exposure=EXPOSURE", "no line to fire", -EINVAL},
		{"gpiochip0,ir", "'ir' does not name a line", -EINVAL},
		{"gpiochip0,ir=!", "'ir=!' does not name a line", -EINVAL},
		{"gpiochip0,,ir=IR_TRIG", "empty", -EINVAL},
		{"gpiochip0,laser=IR_TRIG", "'laser' is none of ir, strobe", -EINVAL},
		{"gpiochip0,ir=IR_TRIG,ir=STROBE", "already IR_TRIG", -EINVAL},
		{"gpiochip0,exposure=EXPOSURE,genlock=SYNC_IN", "already EXPOSURE", -EINVAL},
		{"gpiochip0,ir=IR_TRIG,strobe=!IR_TRIG", "cannot be two things", -EINVAL},
		{"gpiochip0,ir=IR_TRIGGER", "the chip's lines are IR_TRIG, STROBE, HD_TRIG",
		 -ENOENT},
		{"gpiochip0,ir=6", "no line 6", -ENOENT},
		{"gpiochip7,ir=IR_TRIG",
		 "no GPIO chip gpiochip7; there are gpiochip0 "
		 "(fake-gpiochip0)",
		 -ENODEV},
	};

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		assert_int_equal(open_lines(cases[i].rest), cases[i].err);
		assert_null(trigger);
		assert_int_equal(diag.count, 1);
		if (!strstr(diag.text, cases[i].said))
			fail_msg("%s: %s", cases[i].rest, diag.text);
		diag_finish(&diag);
	}
	assert_int_equal(chip->change_count, 0);
}

static void chips_go_by_label_and_lines_by_number_too(void **state)
{
	char path[64];

	(void)state;
	snprintf(path, sizeof(path), "%s/gpiochip0,ir=0", gpio_dir);
	assert_int_equal(open_lines("fake-gpiochip0,ir=5"), 0);
	gpio_trigger_driver.close(trigger);
	assert_int_equal(open_lines(path), 0);
}

static void a_busy_line_is_told_with_its_user(void **state)
{
	(void)state;
	strcpy(chip->lines[1].user, "led-driver");
	assert_int_equal(open_lines(GPIO_LINES), -EBUSY);
	assert_non_null(strstr(diag.text, "line STROBE is used by led-driver"));
	chip->lines[1].user[0] = 0;
	diag_finish(&diag);
	arm_lines(GPIO_LINES, &usual_plan);
	struct trigger *second = NULL;
	assert_int_equal(gpio_trigger_driver.open(&second, GPIO_LINES, &diag), -EBUSY);
	assert_non_null(strstr(diag.text, "line IR_TRIG is used by stage trigger"));
}

static void a_machine_without_chips_says_so(void **state)
{
	(void)state;
	setenv(FAKE_GPIO_DIR_ENV, "/nonexistent", 1);
	assert_int_equal(open_lines(GPIO_LINES), -ENODEV);
	setenv(FAKE_GPIO_DIR_ENV, gpio_dir, 1);
	assert_true(strstr(diag.text, "this kernel has no GPIO") ||
		    strstr(diag.text, "and no other; load its driver"));
}

int main(void)
{
#define FACT(name) cmocka_unit_test_setup_teardown(name, virtual_gpio_begin, virtual_gpio_end)
	const struct CMUnitTest tests[] = {
		FACT(addresses_that_cannot_be_are_refused_with_a_reason),
		FACT(chips_go_by_label_and_lines_by_number_too),
		FACT(a_busy_line_is_told_with_its_user),
		FACT(a_machine_without_chips_says_so),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, virtual_gpio_create, virtual_gpio_destroy);
}
