/*
 * Whether threads may have real-time priority, keep it, and wake up in time.
 */
#include <inttypes.h>
#include <string.h>

#include "ctl/doctor/doctor.h"
#include "ctl/doctor/doctor_tree.h"
#include "ctl/doctor/doctor_unit.h"

#define PRIORITY_NEEDED 70 /* of the guard, the highest */
/* Five simulated cameras hold 0.2 GB of it; real HD cameras more. */
#define MEMLOCK_NEEDED_BYTES (UINT64_C(1) << 30)
#define RT_SHARE_MIN 0.9
#define PROCESSORS_MIN 2

static void say_amount(char field[FINDING_BYTES], uint64_t amount, const char *unit)
{
	if (amount == UINT64_MAX)
		doctor_say(field, "unlimited");
	else
		doctor_say(field, "%" PRIu64 "%s", amount, unit);
}

/* The station runs by its unit: what that grants counts, and the asker's own limit is for stations
 * that are started by hand. */
static void check_limit(struct doctor *doctor, const char *directive, const char *limits_name,
			uint64_t own, uint64_t needed, const char *unit_of_measure)
{
	char granted[64];
	bool has_unit = unit_read(doctor, directive, granted, sizeof(granted));
	bool unit_enough = has_unit && unit_amount(granted) >= needed;
	enum finding_level otherwise = unit_enough ? FINDING_NOTE : FINDING_PROBLEM;
	struct finding *finding;

	if (has_unit) {
		finding = doctor_find(doctor, unit_enough ? FINDING_OK : FINDING_PROBLEM,
				      "%s of the service", directive);
		doctor_say(finding->measured, "%s", granted);
		doctor_say(finding->limit, "at least %" PRIu64 "%s", needed, unit_of_measure);
		if (!unit_enough)
			doctor_say(finding->remedy,
				   "take the line out of your drop-in: systemctl cat staged");
	}
	finding = doctor_find(doctor, own >= needed ? FINDING_OK : otherwise, "%s of %s",
			      limits_name, doctor->facts.asker.name);
	say_amount(finding->measured, own, unit_of_measure);
	doctor_say(finding->limit, "at least %" PRIu64 "%s", needed, unit_of_measure);
	if (own < needed)
		doctor_say(finding->remedy,
			   "for a station started by hand: '%s - %s %s' in "
			   "/etc/security/limits.d/stage.conf, and log in again",
			   doctor->facts.asker.name, limits_name,
			   strcmp(limits_name, "rtprio") == 0 ? "99" : "unlimited");
}

static void check_throttling(struct doctor *doctor)
{
	int64_t runtime_us, period_us = 1000000;

	if (!tree_number(doctor, &runtime_us, "/proc/sys/kernel/sched_rt_runtime_us"))
		return;
	tree_number(doctor, &period_us, "/proc/sys/kernel/sched_rt_period_us");
	bool enough = runtime_us < 0 || (double)runtime_us >= RT_SHARE_MIN * (double)period_us;
	struct finding *finding = doctor_find(doctor, enough ? FINDING_OK : FINDING_PROBLEM,
					      "kernel.sched_rt_runtime_us");

	doctor_say(finding->measured, "%" PRId64 " of %" PRId64, runtime_us, period_us);
	doctor_say(finding->limit, "at least %.0f, or -1", RT_SHARE_MIN * (double)period_us);
	if (!enough)
		doctor_say(finding->remedy,
			   "real-time threads are halted for the rest of each period: sysctl -w "
			   "kernel.sched_rt_runtime_us=950000");
}

static void check_governor(struct doctor *doctor)
{
	char slow[64] = "", governor[64];
	uint32_t slow_count = 0;
	glob_t found;

	tree_glob(doctor, "/sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor", &found);
	for (size_t i = 0; i < found.gl_pathc; i++) {
		tree_line(doctor, governor, sizeof(governor), "%s",
			  tree_name(doctor, found.gl_pathv[i]));
		if (strcmp(governor, "performance") == 0)
			continue;
		slow_count++;
		memcpy(slow, governor, sizeof(slow));
	}
	struct finding *finding = doctor_find(doctor, slow_count ? FINDING_PROBLEM : FINDING_OK,
					      "processors' frequency governor");

	if (slow_count)
		doctor_say(finding->measured, "%s on %u of %zu", slow, slow_count, found.gl_pathc);
	else
		doctor_say(finding->measured, "%s",
			   found.gl_pathc ? "performance" : "none: the frequency is fixed");
	doctor_say(finding->limit, "performance");
	if (slow_count)
		doctor_say(finding->remedy,
			   "threads wake up late: cpupower frequency-set -g performance (package "
			   "linux-cpupower)");
	globfree(&found);
}

/* "#1 SMP PREEMPT_DYNAMIC Debian 6.1..." */
static void check_preemption(struct doctor *doctor)
{
	char version[256];
	int64_t realtime = 0;
	bool by_pins = doctor_uses(doctor, "gpio");

	tree_number(doctor, &realtime, "/sys/kernel/realtime");
	if (!tree_line(doctor, version, sizeof(version), "/proc/sys/kernel/version"))
		return;
	bool full = realtime == 1 || strstr(version, "PREEMPT_RT");
	bool some = full || strstr(version, "PREEMPT");
	struct finding *finding = doctor_find(doctor,
					      !some              ? FINDING_PROBLEM
					      : full || !by_pins ? FINDING_OK
								 : FINDING_NOTE,
					      "kernel's preemption");

	doctor_say(finding->measured, "%s", full ? "PREEMPT_RT" : some ? "preemptible" : "none");
	doctor_say(finding->limit,
		   by_pins ? "PREEMPT_RT, for pulses on GPIO lines" : "preemptible");
	if (finding->level != FINDING_OK)
		doctor_say(finding->remedy,
			   "a thread may wait for a system call of others: install "
			   "linux-image-rt-amd64 (arm64: linux-image-rt-arm64) and boot it");
}

static void check_processors(struct doctor *doctor)
{
	char isolated[128];
	glob_t found;

	tree_glob(doctor, "/sys/devices/system/cpu/cpu[0-9]*", &found);
	tree_line(doctor, isolated, sizeof(isolated), "/sys/devices/system/cpu/isolated");
	if (found.gl_pathc == 0)
		return;
	bool enough = found.gl_pathc >= PROCESSORS_MIN;
	struct finding *finding =
		doctor_find(doctor, enough ? FINDING_OK : FINDING_PROBLEM, "number of processors");

	doctor_say(finding->measured, "%zu, isolated: %s", found.gl_pathc,
		   *isolated ? isolated : "none");
	doctor_say(finding->limit, "at least %d", PROCESSORS_MIN);
	if (!enough)
		doctor_say(finding->remedy, "trigger, cameras and solver share one: a machine with "
					    "more, four for eight cameras");
	globfree(&found);
}

void doctor_check_realtime(struct doctor *doctor)
{
	const struct doctor_facts *facts = &doctor->facts;

	check_limit(doctor, "LimitRTPRIO", "rtprio", facts->rtprio_max, PRIORITY_NEEDED, "");
	check_limit(doctor, "LimitMEMLOCK", "memlock", facts->memlock_max_bytes,
		    MEMLOCK_NEEDED_BYTES, " bytes");
	check_throttling(doctor);
	check_governor(doctor);
	check_preemption(doctor);
	check_processors(doctor);
}
