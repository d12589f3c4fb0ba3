/*
 * What doctor says of real time, clock and disk of machines that are made up.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "made_up_machine.h"

#define UNIT "/usr/lib/systemd/system/staged.service"
#define CPU "/sys/devices/system/cpu/"

static int set_up(void **state)
{
	*state = machine_create();
	return 0;
}

static int tear_down(void **state)
{
	machine_destroy(*state);
	return 0;
}

static void rights_of_the_service_count_and_those_of_a_person_are_noted(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, UNIT, "[Service]\nLimitRTPRIO=99\nLimitMEMLOCK=infinity\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_OK, "LimitRTPRIO of the service");
	machine_expect(machine, FINDING_OK, "LimitMEMLOCK of the service");
	machine_expect(machine, FINDING_NOTE, "rtprio of anna");
	machine_expect(machine, FINDING_NOTE, "memlock of anna");
}

static void a_drop_in_that_takes_rights_away_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, UNIT, "LimitRTPRIO=99\nLimitMEMLOCK=infinity\n");
	machine_write(machine, "/etc/systemd/system/staged.service.d/own.conf",
		      "LimitRTPRIO=5\nLimitMEMLOCK=64M\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_PROBLEM, "LimitRTPRIO of the service");
	machine_expect(machine, FINDING_PROBLEM, "LimitMEMLOCK of the service");
}

static void without_a_service_the_persons_own_rights_count(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_PROBLEM, "rtprio of anna");
	machine_expect(machine, FINDING_PROBLEM, "memlock of anna");
	machine->doctor.facts.rtprio_max = 99;
	machine->doctor.facts.memlock_max_bytes = UINT64_MAX;
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_OK, "rtprio of anna");
	machine_expect(machine, FINDING_OK, "memlock of anna");
}

static void real_time_threads_must_not_be_halted(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, "/proc/sys/kernel/sched_rt_period_us", "1000000\n");
	machine_write(machine, "/proc/sys/kernel/sched_rt_runtime_us", "500000\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_PROBLEM, "kernel.sched_rt_runtime_us");
	machine_write(machine, "/proc/sys/kernel/sched_rt_runtime_us", "950000\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_OK, "kernel.sched_rt_runtime_us");
	machine_write(machine, "/proc/sys/kernel/sched_rt_runtime_us", "-1\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_OK, "kernel.sched_rt_runtime_us");
}

static void one_processor_that_saves_power_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, CPU "cpu0/cpufreq/scaling_governor", "performance\n");
	machine_write(machine, CPU "cpu1/cpufreq/scaling_governor", "powersave\n");
	machine_examine(machine, doctor_check_realtime);
	const struct finding *finding =
		machine_expect(machine, FINDING_PROBLEM, "processors' frequency governor");

	assert_string_equal(finding->measured, "powersave on 1 of 2");
	machine_write(machine, CPU "cpu1/cpufreq/scaling_governor", "performance\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_OK, "processors' frequency governor");
}

static void preemption_is_judged_by_who_makes_the_pulses(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, "/proc/sys/kernel/version", "#1 SMP Debian 6.1.1\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_PROBLEM, "kernel's preemption");
	machine_write(machine, "/proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_OK, "kernel's preemption");
	strcpy(machine->config.trigger, "gpio:gpiochip0,ir=1");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_NOTE, "kernel's preemption");
	machine_write(machine, "/sys/kernel/realtime", "1\n");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_OK, "kernel's preemption");
}

static void a_machine_without_kernel_files_is_told_so(void **state)
{
	struct machine *machine = *state;

	machine_examine(machine, doctor_check_system);
	machine_expect(machine, FINDING_PROBLEM, "/proc");
	machine_expect(machine, FINDING_PROBLEM, "/sys");
	machine_examine(machine, doctor_check_realtime);
	machine_expect_none(machine, "number of processors");
	machine_expect_none(machine, "kernel's preemption");
	machine_write(machine, "/proc/sys/kernel/version", "");
	machine_write(machine, CPU "cpu0/online", "1\n");
	machine_examine(machine, doctor_check_system);
	machine_expect(machine, FINDING_OK, "/proc");
	machine_expect(machine, FINDING_OK, "/sys");
}

static void one_processor_is_too_few(void **state)
{
	struct machine *machine = *state;

	machine_write(machine, CPU "cpu0/online", "1\n");
	machine_write(machine, CPU "cpuidle/x", "");
	machine_examine(machine, doctor_check_realtime);
	machine_expect(machine, FINDING_PROBLEM, "number of processors");
}

static void processors_are_counted(void **state)
{
	struct machine *machine = *state;

	for (int i = 0; i < 12; i++) {
		char path[64];

		snprintf(path, sizeof(path), CPU "cpu%d/online", i);
		machine_write(machine, path, "1\n");
	}
	machine_write(machine, CPU "isolated", "2-3\n");
	machine_examine(machine, doctor_check_realtime);
	assert_string_equal(machine_expect(machine, FINDING_OK, "number of")->measured,
			    "12, isolated: 2-3");
}

static void a_clock_that_is_read_over_a_bus_is_a_problem(void **state)
{
	struct machine *machine = *state;
	const char *path = "/sys/devices/system/clocksource/clocksource0/current_clocksource";

	machine_write(machine, path, "hpet\n");
	machine->doctor.facts.clock_read_ns = 1500;
	machine_examine(machine, doctor_check_clock);
	machine_expect(machine, FINDING_PROBLEM, "clock source");
	machine_expect(machine, FINDING_PROBLEM, "reading CLOCK_MONOTONIC");
	machine_write(machine, path, "tsc\n");
	machine->doctor.facts.clock_read_ns = 25;
	machine_examine(machine, doctor_check_clock);
	machine_expect(machine, FINDING_OK, "clock source");
	machine_expect(machine, FINDING_OK, "reading CLOCK_MONOTONIC");
}

static void a_clock_that_ntp_hurries_is_a_problem(void **state)
{
	struct machine *machine = *state;
	struct doctor_facts *facts = &machine->doctor.facts;

	facts->clock_slew_ppm = -400;
	machine_examine(machine, doctor_check_clock);
	machine_expect(machine, FINDING_PROBLEM, "NTP slews the clock");
	machine_expect(machine, FINDING_NOTE, "time of day");
	facts->clock_slew_ppm = 12;
	facts->utc_synchronised = true;
	machine_examine(machine, doctor_check_clock);
	machine_expect(machine, FINDING_OK, "NTP slews the clock");
	machine_expect(machine, FINDING_OK, "time of day");
}

static void a_disk_must_be_faster_than_hd_cameras(void **state)
{
	struct machine *machine = *state;
	struct doctor_facts *facts = &machine->doctor.facts;

	machine_add_camera(machine, "hd0", "v4l2:/dev/video0", ROLE_HD, 8000000); /* 200 MB/s */
	machine_add_camera(machine, "ir0", "v4l2:/dev/video1", ROLE_IR, 8000000); /* not recorded */
	facts->disk_free_bytes = UINT64_C(2000000000000);
	facts->disk_bytes_per_s = 250e6;
	machine_examine(machine, doctor_check_disk);
	machine_expect(machine, FINDING_PROBLEM, "writing to /takes");
	machine_expect(machine, FINDING_OK, "space in /takes");
	facts->disk_bytes_per_s = 350e6;
	machine_examine(machine, doctor_check_disk);
	machine_expect(machine, FINDING_OK, "writing to /takes");
	facts->disk_free_bytes = UINT64_C(60000000000);
	machine_examine(machine, doctor_check_disk);
	machine_expect(machine, FINDING_PROBLEM, "space in /takes");
	facts->disk_free_bytes = UINT64_C(300000000000);
	machine_examine(machine, doctor_check_disk);
	machine_expect(machine, FINDING_NOTE, "space in /takes");
}

static void a_directory_that_cannot_be_written_is_a_problem(void **state)
{
	struct machine *machine = *state;

	machine->doctor.facts.disk_error = EACCES;
	machine_examine(machine, doctor_check_disk);
	const struct finding *finding =
		machine_expect(machine, FINDING_PROBLEM, "writing to /takes");
	assert_non_null(strstr(finding->remedy, "write there"));
	machine->doctor.facts.disk_error = ENOSPC;
	machine_examine(machine, doctor_check_disk);
	finding = machine_expect(machine, FINDING_PROBLEM, "writing to /takes");
	assert_non_null(strstr(finding->remedy, "make room"));
}

static void hd_images_of_unknown_size_are_noted(void **state)
{
	struct machine *machine = *state;

	machine_add_camera(machine, "hd0", "v4l2:/dev/video0", ROLE_HD, 0);
	machine_examine(machine, doctor_check_disk);
	machine_expect(machine, FINDING_NOTE, "images of hd0");
}

#define FACT(fact) cmocka_unit_test_setup_teardown(fact, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		FACT(rights_of_the_service_count_and_those_of_a_person_are_noted),
		FACT(a_drop_in_that_takes_rights_away_is_a_problem),
		FACT(without_a_service_the_persons_own_rights_count),
		FACT(real_time_threads_must_not_be_halted),
		FACT(one_processor_that_saves_power_is_a_problem),
		FACT(preemption_is_judged_by_who_makes_the_pulses),
		FACT(a_machine_without_kernel_files_is_told_so),
		FACT(one_processor_is_too_few),
		FACT(processors_are_counted),
		FACT(a_clock_that_is_read_over_a_bus_is_a_problem),
		FACT(a_clock_that_ntp_hurries_is_a_problem),
		FACT(a_disk_must_be_faster_than_hd_cameras),
		FACT(a_directory_that_cannot_be_written_is_a_problem),
		FACT(hd_images_of_unknown_size_are_noted),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
