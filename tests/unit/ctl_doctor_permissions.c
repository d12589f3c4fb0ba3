/*
 * What doctor says of people, groups and device nodes of machines that are made up.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "made_up_machine.h"

#define OPERATORS 4002

static void add_group(struct machine *machine, gid_t gid)
{
	struct person *anna = &machine->doctor.facts.asker;

	anna->gids[anna->gid_count++] = gid;
}

static int set_up(void **state)
{
	struct machine *machine = machine_create();

	machine_write(machine, "/etc/group",
		      "root:x:0:\nvideo:x:44:\nstage:x:4001:anna\nstage-operator:x:4002:\n");
	machine_write(machine, "/etc/passwd",
		      "root:x:0:0::/root:/bin/sh\nstaged:x:990:4001::/:/sbin/nologin\n");
	machine_write(machine, "/usr/lib/systemd/system/staged.service",
		      "[Service]\nUser=staged\nSupplementaryGroups=stage-operator video\n");
	machine_write(machine, "/usr/lib/udev/rules.d/70-stage.rules", "");
	*state = machine;
	return 0;
}

static int tear_down(void **state)
{
	machine_destroy(*state);
	return 0;
}

static void a_person_outside_the_groups_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, "anna in group stage-operator");
	assert_non_null(
		strstr(machine_expect(machine, FINDING_PROBLEM, "anna in group stage")->remedy,
		       "log in again"));
	add_group(machine, 4001);
	add_group(machine, OPERATORS);
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_OK, "anna in group stage-operator");
	machine_expect(machine, FINDING_OK, "anna in group stage");
}

static void groups_that_there_are_not_are_a_problem_once_the_service_is_installed(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, "/etc/group", "root:x:0:\n");
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, "groups stage and stage-operator");
}

static void the_services_groups_are_those_of_its_unit_too(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_OK, "user staged in group stage-operator");
	machine_write(machine, "/usr/lib/systemd/system/staged.service", "[Service]\n");
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, "user staged in group stage-operator");
	machine_write(machine, "/etc/passwd", "root:x:0:0::/root:/bin/sh\n");
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, "user staged in group stage-operator");
}

static void without_an_installed_service_nothing_is_asked_of_it(void **state)
{
	struct machine *machine = *state;
	char unit[128];

	snprintf(unit, sizeof(unit), "%s/usr/lib/systemd/system/staged.service", machine->root);
	unlink(unit);
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_NOTE, "service staged");
	machine_expect_none(machine, "user staged");
}

static void a_missing_udev_rule_is_a_problem_for_devices(void **state)
{
	struct machine *machine = *state;
	char rules[128];

	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_OK, "udev rule");
	snprintf(rules, sizeof(rules), "%s/usr/lib/udev/rules.d/70-stage.rules", machine->root);
	unlink(rules);
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, "udev rule");
}

/* The files are those of whoever runs the test; their group is made anna's, or not. */
static void nodes_must_be_open_to_the_person_and_to_the_service(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, "/dev/video0", "");
	machine_write(machine, "/dev/gpiochip0", "");
	machine_chmod(machine, "/dev/video0", 0660);
	machine_chmod(machine, "/dev/gpiochip0", 0666);
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, "cameras /dev/video* for anna");
	machine_expect(machine, FINDING_PROBLEM, "cameras /dev/video* for staged");
	machine_expect(machine, FINDING_OK, "GPIO chips /dev/gpiochip* for anna");
	add_group(machine, getegid());
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_OK, "cameras /dev/video* for anna");
	machine_expect(machine, FINDING_PROBLEM, "cameras /dev/video* for staged");
}

static void a_configured_device_without_any_node_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_permissions);
	machine_expect_none(machine, "cameras /dev/video*");
	machine_add_camera(machine, "ir0", "v4l2:/dev/video0", ROLE_IR, 1000);
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, "cameras /dev/video*");
}

static void usb_cameras_and_triggers_are_known_by_what_they_are(void **state)
{
	struct machine *machine = *state;
	const char *usb = "USB cameras and triggers for anna";

	machine_write(machine, "/sys/bus/usb/devices/1-1/idVendor", "046d\n");
	machine_write(machine, "/sys/bus/usb/devices/1-1/busnum", "1\n");
	machine_write(machine, "/sys/bus/usb/devices/1-1/devnum", "2\n");
	machine_examine(machine, doctor_check_permissions);
	machine_expect_none(machine, usb);
	machine_write(machine, "/sys/bus/usb/devices/1-1/1-1:1.0/bInterfaceClass", "ef\n");
	machine_write(machine, "/sys/bus/usb/devices/1-1/1-1:1.0/bInterfaceSubClass", "05\n");
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_PROBLEM, usb);
	machine_write(machine, "/dev/bus/usb/001/002", "");
	machine_chmod(machine, "/dev/bus/usb/001/002", 0666);
	machine_examine(machine, doctor_check_permissions);
	machine_expect(machine, FINDING_OK, usb);
}

#define FACT(fact) cmocka_unit_test_setup_teardown(fact, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		FACT(a_person_outside_the_groups_is_a_problem),
		FACT(groups_that_there_are_not_are_a_problem_once_the_service_is_installed),
		FACT(the_services_groups_are_those_of_its_unit_too),
		FACT(without_an_installed_service_nothing_is_asked_of_it),
		FACT(a_missing_udev_rule_is_a_problem_for_devices),
		FACT(nodes_must_be_open_to_the_person_and_to_the_service),
		FACT(a_configured_device_without_any_node_is_a_problem),
		FACT(usb_cameras_and_triggers_are_known_by_what_they_are),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
