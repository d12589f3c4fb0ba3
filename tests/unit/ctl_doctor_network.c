/*
 * What doctor says of networks that are made up. 192.168.10.0/24 is that of the cameras.
 */
#include <arpa/inet.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "made_up_machine.h"

#define HEADER "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\tMTU\tWindow\tIRTT\n"
#define FRAME_BYTES 500000 /* 50 MB/s at 100 Hz */

static void add_route(char *routes, const char *interface, const char *to, const char *mask,
		      int flags, int metric)
{
	sprintf(routes + strlen(routes), "%s\t%08X\t00000000\t%04X\t0\t0\t%d\t%08X\t0\t0\t0\n",
		interface, inet_addr(to), (unsigned int)flags, metric, inet_addr(mask));
}

static void write_port(struct machine *machine, const char *name, const char *file,
		       const char *text)
{
	char path[128];

	snprintf(path, sizeof(path), "/sys/class/net/%s/%s", name, file);
	machine_write(machine, path, text);
}

/* A port with everything as it should be. */
static void write_good_port(struct machine *machine, const char *name)
{
	char path[128];

	write_port(machine, name, "mtu", "9000\n");
	write_port(machine, name, "speed", "10000\n");
	write_port(machine, name, "operstate", "up\n");
	write_port(machine, name, "statistics/rx_missed_errors", "0\n");
	snprintf(path, sizeof(path), "/proc/sys/net/ipv4/conf/%s/rp_filter", name);
	machine_write(machine, path, "1\n");
}

static int set_up(void **state)
{
	struct machine *machine = machine_create();
	char routes[1024] = HEADER;

	add_route(routes, "eth0", "0.0.0.0", "0.0.0.0", 3, 0);
	add_route(routes, "cam0", "192.168.10.0", "255.255.255.0", 1, 100);
	machine_write(machine, "/proc/net/route", routes);
	machine_write(machine, "/proc/sys/net/core/rmem_max", "33554432\n");
	machine_write(machine, "/proc/sys/net/ipv4/conf/all/rp_filter", "0\n");
	write_good_port(machine, "cam0");
	machine_add_camera(machine, "ir0", "aravis:192.168.10.20", ROLE_IR, FRAME_BYTES);
	machine_add_camera(machine, "ir1", "aravis:192.168.10.21", ROLE_IR, FRAME_BYTES);
	*state = machine;
	return 0;
}

static int tear_down(void **state)
{
	machine_destroy(*state);
	return 0;
}

static void a_good_network_is_not_complained_of(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_network);
	assert_int_equal(doctor_count(&machine->doctor, FINDING_OK), machine->doctor.finding_count);
	machine_expect(machine, FINDING_OK, "net.core.rmem_max");
	machine_expect(machine, FINDING_OK, "link of cam0");
	machine_expect(machine, FINDING_OK, "MTU of cam0");
	machine_expect(machine, FINDING_OK, "bandwidth of cam0");
	machine_expect(machine, FINDING_OK, "rp_filter of cam0");
	machine_expect(machine, FINDING_OK, "packets lost by cam0");
}

static void buffers_must_hold_two_frames(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, "/proc/sys/net/core/rmem_max", "212992\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_PROBLEM, "net.core.rmem_max");
	machine_write(machine, "/proc/sys/net/core/rmem_max", "2000000\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_NOTE, "net.core.rmem_max");
}

static void buffers_do_not_matter_without_network_cameras(void **state)
{
	struct machine *machine = *state;

	machine->config.camera_count = 0;
	machine_write(machine, "/proc/sys/net/core/rmem_max", "212992\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_NOTE, "net.core.rmem_max");
}

static void small_packets_are_a_problem_at_high_rates(void **state)
{
	struct machine *machine = *state;

	write_port(machine, "cam0", "mtu", "1500\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_PROBLEM, "MTU of cam0");
	machine->doctor.loads[0].bytes_per_s = machine->doctor.loads[1].bytes_per_s = 1e6;
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_NOTE, "MTU of cam0");
}

static void cameras_that_share_a_port_must_fit_through_it(void **state)
{
	struct machine *machine = *state;

	write_port(machine, "cam0", "speed", "1000\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_OK, "bandwidth of cam0");
	machine_add_camera(machine, "ir2", "aravis:192.168.10.22", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_network);
	assert_string_equal(machine_expect(machine, FINDING_PROBLEM, "bandwidth of cam0")->measured,
			    "150 MB/s of 3 cameras");
	machine->doctor.loads[2].bytes_per_s = 10e6;
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_NOTE, "bandwidth of cam0");
}

static void a_link_that_is_down_is_a_problem(void **state)
{
	struct machine *machine = *state;

	write_port(machine, "cam0", "operstate", "down\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_PROBLEM, "link of cam0");
}

static void two_ports_with_one_network_and_a_strict_filter_are_a_problem(void **state)
{
	struct machine *machine = *state;
	char routes[1024] = HEADER;

	add_route(routes, "cam0", "192.168.10.0", "255.255.255.0", 1, 100);
	add_route(routes, "cam1", "192.168.10.0", "255.255.255.0", 1, 101);
	machine_write(machine, "/proc/net/route", routes);
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_PROBLEM, "rp_filter of cam0");
	machine_write(machine, "/proc/sys/net/ipv4/conf/cam0/rp_filter", "2\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_NOTE, "rp_filter of cam0");
}

static void a_camera_behind_a_gateway_or_nowhere_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine_add_camera(machine, "far", "aravis:10.0.0.7", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_PROBLEM, "way to far");
	machine_expect_none(machine, "way to ir0");
	machine_write(machine, "/proc/net/route", HEADER);
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_PROBLEM, "way to ir0");
}

static void the_narrowest_network_is_taken(void **state)
{
	struct machine *machine = *state;
	char routes[1024] = HEADER;

	write_good_port(machine, "cam1");
	add_route(routes, "cam1", "192.168.10.21", "255.255.255.255", 1, 0);
	add_route(routes, "cam0", "192.168.10.0", "255.255.255.0", 1, 0);
	machine_write(machine, "/proc/net/route", routes);
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_OK, "MTU of cam0");
	machine_expect(machine, FINDING_OK, "MTU of cam1");
	machine_expect(machine, FINDING_OK, "rp_filter of cam1");
}

static void lost_packets_are_noted(void **state)
{
	struct machine *machine = *state;

	write_port(machine, "cam0", "statistics/rx_missed_errors", "17\n");
	machine_examine(machine, doctor_check_network);
	machine_expect(machine, FINDING_NOTE, "packets lost by cam0");
}

static void a_machine_without_network_files_is_borne(void **state)
{
	struct machine *machine = machine_create();

	(void)state;
	machine_add_camera(machine, "lo", "aravis:127.0.0.11", ROLE_IR, FRAME_BYTES);
	machine_examine(machine, doctor_check_network);
	machine_expect_none(machine, "way to lo");
	machine_destroy(machine);
}

#define FACT(fact) cmocka_unit_test_setup_teardown(fact, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		FACT(a_good_network_is_not_complained_of),
		FACT(buffers_must_hold_two_frames),
		FACT(buffers_do_not_matter_without_network_cameras),
		FACT(small_packets_are_a_problem_at_high_rates),
		FACT(cameras_that_share_a_port_must_fit_through_it),
		FACT(a_link_that_is_down_is_a_problem),
		FACT(two_ports_with_one_network_and_a_strict_filter_are_a_problem),
		FACT(a_camera_behind_a_gateway_or_nowhere_is_a_problem),
		FACT(the_narrowest_network_is_taken),
		FACT(lost_packets_are_noted),
		FACT(a_machine_without_network_files_is_borne),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
