/*
 * What doctor says of strobes, on a GPIO chip that is a file. 100 Hz, 200 us, a tenth of the time
 * at most.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "drivers/gpio/gpio_lines.h"
#include "made_up_machine.h"
#include "tests/gpio/fake_gpio.h"

#define STROBE_BIT 2

static struct fake_gpio *fake;

static int set_up(void **state)
{
	struct machine *machine = machine_create();

	setenv(FAKE_GPIO_DIR_ENV, machine->root, 1);
	fake = fake_gpio_create(machine->root, "gpiochip0");
	strcpy(machine->config.trigger, "gpio:gpiochip0,ir=IR_TRIG,strobe=STROBE");
	machine->config.plan.strobe_width_ns = 200000;
	machine->config.plan.strobe_duty_max = 0.1;
	*state = machine;
	return 0;
}

static int tear_down(void **state)
{
	machine_destroy(*state);
	return 0;
}

static void a_line_that_is_lit_when_nobody_drives_it_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_OK, "line STROBE");
	fake->levels = STROBE_BIT;
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_PROBLEM, "line STROBE");
	strcpy(machine->config.trigger, "gpio:gpiochip0,strobe=!STROBE");
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_OK, "line STROBE");
	fake->levels = 0;
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_PROBLEM, "line STROBE");
}

static void a_line_that_the_station_has_is_left_alone(void **state)
{
	struct machine *machine = *state;
	struct gpio_outputs *outputs;
	struct gpio_chip *chip;
	const uint32_t offset = 1;
	char path[128];

	snprintf(path, sizeof(path), "%s/gpiochip0", machine->root);
	assert_int_equal(gpio_chip_open(&chip, path), 0);
	assert_int_equal(gpio_outputs_request(&outputs, chip, "stage", &offset, 1, 1), 0);
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_NOTE, "line STROBE");
	assert_int_equal(fake->levels, STROBE_BIT);
	gpio_outputs_release(outputs);
	gpio_chip_close(chip);
}

static void a_chip_that_is_not_there_is_noted(void **state)
{
	struct machine *machine = *state;

	strcpy(machine->config.trigger, "gpio:gpiochip7,strobe=STROBE");
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_NOTE, "line STROBE");
}

static void hardware_that_nobody_confirmed_is_asked_for(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_NOTE, "strobe's one-shot");
	machine_expect(machine, FINDING_NOTE, "strobe's pull-down");
	machine->config.strobe_one_shot_ns = 500000;
	machine->config.strobe_pull_down = true;
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_OK, "strobe's one-shot");
	machine_expect(machine, FINDING_OK, "strobe's pull-down");
	machine_expect(machine, FINDING_OK, "strobe's duty");
}

static void a_one_shot_must_outlast_the_pulse_and_spare_the_strobe(void **state)
{
	struct machine *machine = *state;

	machine->config.strobe_one_shot_ns = 150000;
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_PROBLEM, "strobe's one-shot");
	machine->config.strobe_one_shot_ns = 1500000;
	machine_examine(machine, doctor_check_strobe);
	machine_expect(machine, FINDING_PROBLEM, "strobe's one-shot");
}

static void without_a_strobe_nothing_is_asked(void **state)
{
	static const char *const without[] = {"free", "sim", "gpio:gpiochip0,ir=IR_TRIG",
					      "usb:A,ir=D5"};
	static const char *const with[] = {"usb", "usb:A", "usb:A,strobe=D6"};
	struct machine *machine = *state;

	for (int i = 0; i < 4; i++) {
		strcpy(machine->config.trigger, without[i]);
		machine_examine(machine, doctor_check_strobe);
		machine_expect_none(machine, "strobe's one-shot");
	}
	for (int i = 0; i < 3; i++) {
		strcpy(machine->config.trigger, with[i]);
		machine_examine(machine, doctor_check_strobe);
		machine_expect(machine, FINDING_NOTE, "strobe's one-shot");
	}
}

#define FACT(fact) cmocka_unit_test_setup_teardown(fact, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		FACT(a_line_that_is_lit_when_nobody_drives_it_is_a_problem),
		FACT(a_line_that_the_station_has_is_left_alone),
		FACT(a_chip_that_is_not_there_is_noted),
		FACT(hardware_that_nobody_confirmed_is_asked_for),
		FACT(a_one_shot_must_outlast_the_pulse_and_spare_the_strobe),
		FACT(without_a_strobe_nothing_is_asked),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
