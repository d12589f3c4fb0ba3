/*
 * What doctor says of USB buses that are made up: bus 1 of USB 2 with a hub at port 3, bus 2 of USB
 * 3.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "ctl/doctor/doctor_usb.h"
#include "made_up_machine.h"

#define FRAME_BYTES 150000 /* 15 MB/s at 100 Hz */

static struct usb_topology usb;

static struct usb_device *plug(const char *name, const char *serial, int speed_mbit)
{
	struct usb_device *device = &usb.devices[usb.count++];

	*device = (struct usb_device){.speed_mbit = speed_mbit, .version = 0x0200};
	snprintf(device->name, sizeof(device->name), "%s", name);
	snprintf(device->serial, sizeof(device->serial), "%s", serial);
	return device;
}

static int set_up(void **state)
{
	struct machine *machine = machine_create();

	usb = (struct usb_topology){0};
	plug("usb1", "controller", 480);
	plug("1-3", "", 480);
	plug("usb2", "controller", 5000);
	machine->doctor.facts.usb = &usb;
	*state = machine;
	return 0;
}

static int tear_down(void **state)
{
	machine_destroy(*state);
	return 0;
}

static void names_tell_what_hangs_on_what(void **state)
{
	(void)state;
	assert_true(usb_is_below("1-3.2", "usb1"));
	assert_true(usb_is_below("1-3.2", "1-3"));
	assert_true(usb_is_below("1-3", "1-3"));
	assert_false(usb_is_below("1-31", "1-3"));
	assert_false(usb_is_below("11-3", "usb1"));
	assert_false(usb_is_below("1-3", "1-3.2"));
}

static void cameras_that_do_not_fit_through_one_bus_are_a_problem(void **state)
{
	struct machine *machine = *state;

	plug("1-3.1", "A", 480);
	plug("1-3.2", "B", 480);
	plug("1-4", "C", 480);
	machine_add_camera(machine, "a", "v4l2:serial=A", ROLE_IR, FRAME_BYTES);
	machine_add_camera(machine, "b", "v4l2:serial=B,card=X", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_OK, "a, v4l2:serial=A");
	machine_expect(machine, FINDING_OK, "bus usb1");
	machine_expect(machine, FINDING_OK, "link 1-3");
	machine_add_camera(machine, "c", "v4l2:serial=C", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_usb);
	assert_string_equal(machine_expect(machine, FINDING_PROBLEM, "bus usb1")->measured,
			    "45 MB/s of 3 cameras");
	machine_expect(machine, FINDING_OK, "link 1-3");
	machine_expect_none(machine, "bus usb2");
}

static void one_camera_alone_may_be_too_much(void **state)
{
	struct machine *machine = *state;

	plug("1-1", "A", 480);
	machine_add_camera(machine, "a", "v4l2:serial=A", ROLE_IR, 3 * FRAME_BYTES);
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_PROBLEM, "bus usb1");
	machine_expect(machine, FINDING_PROBLEM, "link 1-1");
}

static void a_bus_that_is_nearly_full_is_noted(void **state)
{
	struct machine *machine = *state;

	plug("1-1", "A", 480);
	machine_add_camera(machine, "a", "v4l2:serial=A", ROLE_IR, 350000);
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_NOTE, "bus usb1");
}

static void images_of_unknown_size_are_not_passed_over(void **state)
{
	struct machine *machine = *state;

	plug("1-1", "A", 480);
	machine_add_camera(machine, "a", "v4l2:serial=A", ROLE_HD, 0);
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_NOTE, "bus usb1");
}

static void a_camera_is_found_by_its_node_its_link_and_its_name(void **state)
{
	struct machine *machine = *state;
	const char *interface = "/sys/devices/pci/usb1/1-3/1-3.1/1-3.1:1.0";
	char file[128];

	plug("1-3.1", "", 480);
	snprintf(file, sizeof(file), "%s/modalias", interface);
	machine_write(machine, file, "");
	machine_write(machine, "/sys/class/video4linux/video7/name", "See3CAM: left\n");
	machine_link(machine, "/sys/class/video4linux/video7/device", interface);
	machine_write(machine, "/dev/video7", "");
	machine_link(machine, "/dev/v4l/by-path/left", "/dev/video7");
	machine_add_camera(machine, "node", "v4l2:/dev/video7", ROLE_IR, FRAME_BYTES);
	machine_add_camera(machine, "link", "v4l2:/dev/v4l/by-path/left", ROLE_IR, FRAME_BYTES);
	machine_add_camera(machine, "card", "v4l2:card=See3CAM: left", ROLE_IR, FRAME_BYTES);
	for (uint32_t c = 0; c < 3; c++)
		assert_int_equal(usb_of_camera(&machine->doctor, c), 3);
}

static void a_camera_that_is_not_plugged_in_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine_add_camera(machine, "a", "v4l2:serial=A", ROLE_IR, FRAME_BYTES);
	machine_add_camera(machine, "net", "aravis:Maker-Model-77", ROLE_IR, FRAME_BYTES);
	machine_add_camera(machine, "ip", "aravis:192.168.1.2", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_PROBLEM, "a, v4l2:serial=A");
	machine_expect(machine, FINDING_NOTE, "net, aravis:");
	machine_expect_none(machine, "ip, aravis:");
}

static void a_usb3_vision_camera_belongs_on_usb_3(void **state)
{
	struct machine *machine = *state;
	struct usb_device *camera = plug("1-1", "77", 480);

	camera->is_vision = true;
	machine_add_camera(machine, "a", "aravis:Maker-Model-77", ROLE_IR, FRAME_BYTES);
	machine_write(machine, "/sys/module/usbcore/parameters/usbfs_memory_mb", "16\n");
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_PROBLEM, "a, aravis:Maker-Model-77");
	machine_expect(machine, FINDING_PROBLEM, "usbfs_memory_mb");
	strcpy(camera->name, "2-1");
	camera->speed_mbit = 5000;
	machine_write(machine, "/sys/module/usbcore/parameters/usbfs_memory_mb", "1000\n");
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_OK, "a, aravis:Maker-Model-77");
	machine_expect(machine, FINDING_OK, "usbfs_memory_mb");
	machine_expect(machine, FINDING_OK, "bus usb2");
}

static void a_usb_3_device_on_a_usb_2_port_is_noted(void **state)
{
	struct machine *machine = *state;

	plug("1-1", "A", 480)->version = 0x0210;
	machine_add_camera(machine, "a", "v4l2:serial=A", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_NOTE, "a, v4l2:serial=A");
}

static void the_triggers_adapter_is_looked_for(void **state)
{
	struct machine *machine = *state;

	strcpy(machine->config.trigger, "usb:FT1,strobe=D6");
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_PROBLEM, "trigger, usb:FT1");
	struct usb_device *adapter = plug("1-2", "FT1", 480);

	adapter->vendor = 0x0403;
	adapter->product = 0x6014;
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_OK, "trigger, usb:FT1");
	strcpy(machine->config.trigger, "usb");
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_OK, "trigger, usb");
	strcpy(machine->config.trigger, "usb:FT2");
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_PROBLEM, "trigger, usb:FT2");
	strcpy(machine->config.trigger, "usbx:FT1");
	machine_examine(machine, doctor_check_usb);
	machine_expect_none(machine, "trigger, usb");
}

static void usb_that_cannot_be_looked_at_is_told(void **state)
{
	struct machine *machine = *state;

	strcpy(usb.error, "Access denied");
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_NOTE, "USB");
	machine_add_camera(machine, "a", "v4l2:serial=A", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_usb);
	machine_expect(machine, FINDING_PROBLEM, "USB");
}

static void this_machines_buses_can_be_read(void **state)
{
	struct machine *machine = *state;
	static struct usb_topology real;

	usb_topology_read(&machine->doctor, &real);
	assert_string_equal(real.error, "");
	assert_int_equal(real.count > 0, access("/sys/bus/usb/devices/usb1", F_OK) == 0);
}

#define FACT(fact) cmocka_unit_test_setup_teardown(fact, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		FACT(names_tell_what_hangs_on_what),
		FACT(cameras_that_do_not_fit_through_one_bus_are_a_problem),
		FACT(one_camera_alone_may_be_too_much),
		FACT(a_bus_that_is_nearly_full_is_noted),
		FACT(images_of_unknown_size_are_not_passed_over),
		FACT(a_camera_is_found_by_its_node_its_link_and_its_name),
		FACT(a_camera_that_is_not_plugged_in_is_a_problem),
		FACT(a_usb3_vision_camera_belongs_on_usb_3),
		FACT(a_usb_3_device_on_a_usb_2_port_is_noted),
		FACT(the_triggers_adapter_is_looked_for),
		FACT(usb_that_cannot_be_looked_at_is_told),
		FACT(this_machines_buses_can_be_read),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
