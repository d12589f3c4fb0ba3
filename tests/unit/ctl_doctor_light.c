/*
 * What doctor makes of pictures with lit and with dark strobes.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "ctl/doctor/doctor_light.h"
#include "made_up_machine.h"

enum { IR, HD };

static struct light_seen seen;

static void judge_ir(struct doctor *doctor)
{
	doctor_judge_light(doctor, IR, &seen);
}

static void judge_hd(struct doctor *doctor)
{
	doctor_judge_light(doctor, HD, &seen);
}

static int set_up(void **state)
{
	struct machine *machine = machine_create();

	machine_add_camera(machine, "ir0", "sim:ir0", ROLE_IR, 1000);
	machine_add_camera(machine, "hd0", "sim:hd0", ROLE_HD, 1000);
	seen = (struct light_seen){.lit = {{60, 70}, {60, 70}}, .dark = {{60, 0}, {60, 0}}};
	*state = machine;
	return 0;
}

static int tear_down(void **state)
{
	machine_destroy(*state);
	return 0;
}

static void strobes_that_make_an_hd_picture_lighter_are_a_problem(void **state)
{
	seen.lit[0].mean_grey = 64;
	seen.lit[1].mean_grey = 63;
	machine_examine(*state, judge_hd);
	machine_expect(*state, FINDING_PROBLEM, "IR strobes in the picture of hd0");
}

static void light_that_comes_and_goes_by_itself_is_not_the_strobes(void **state)
{
	seen.lit[0].mean_grey = 90;
	machine_examine(*state, judge_hd);
	machine_expect(*state, FINDING_OK, "IR strobes in the picture of hd0");
	seen.lit[0].mean_grey = seen.lit[1].mean_grey = 40; /* somebody stood in the way */
	machine_examine(*state, judge_hd);
	machine_expect(*state, FINDING_OK, "IR strobes in the picture of hd0");
}

static void spots_that_shine_without_strobes_are_a_problem(void **state)
{
	seen.dark[0].spots = 12;
	seen.dark[1].spots = 3; /* fired in every fourth shot */
	machine_examine(*state, judge_ir);
	machine_expect(*state, FINDING_PROBLEM, "other lights in the picture of ir0");
}

static void a_spot_in_one_look_alone_is_none(void **state)
{
	seen.dark[0].spots = 1;
	machine_examine(*state, judge_ir);
	machine_expect(*state, FINDING_OK, "other lights in the picture of ir0");
}

static void without_a_strobe_of_ours_nothing_is_opened(void **state)
{
	static const char *const without[] = {"free", "gpio:gpiochip0,ir=IR_TRIG", "usb:A,ir=D5",
					      "freely"};
	static struct stage stage;
	struct machine *machine = *state;

	stage.config = machine->config;
	stage.config.plan.strobe_width_ns = 200000;
	for (size_t i = 0; i < sizeof(without) / sizeof(without[0]); i++) {
		strcpy(stage.config.trigger, without[i]);
		machine->doctor.finding_count = 0;
		doctor_measure_light(&machine->doctor, &stage);
		assert_string_equal(machine_expect(machine, FINDING_NOTE, "cross-light")->measured,
				    "not measured: this machine fires no strobe");
	}
}

#define FACT(fact) cmocka_unit_test_setup_teardown(fact, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		FACT(strobes_that_make_an_hd_picture_lighter_are_a_problem),
		FACT(light_that_comes_and_goes_by_itself_is_not_the_strobes),
		FACT(spots_that_shine_without_strobes_are_a_problem),
		FACT(a_spot_in_one_look_alone_is_none),
		FACT(without_a_strobe_of_ours_nothing_is_opened),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
