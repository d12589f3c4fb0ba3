/*
 * Whether the clock that everything is measured by is quick to read and runs evenly.
 */
#include <math.h>
#include <string.h>

#include "ctl/doctor/doctor.h"
#include "ctl/doctor/doctor_tree.h"

#define READ_MAX_NS 1000
#define SLEW_MAX_PPM 250 /* NTP gives up at 500 */

/* Read by a call into the kernel or over a bus, and some of them coarse. */
static bool is_slow(const char *source)
{
	static const char *const slow[] = {"hpet", "acpi_pm", "jiffies", "refined-jiffies"};

	for (size_t i = 0; i < sizeof(slow) / sizeof(slow[0]); i++)
		if (strcmp(source, slow[i]) == 0)
			return true;
	return false;
}

static void check_source(struct doctor *doctor)
{
	char source[64];
	struct finding *finding;

	if (!tree_line(doctor, source, sizeof(source),
		       "/sys/devices/system/clocksource/clocksource0/current_clocksource"))
		return;
	finding =
		doctor_find(doctor, is_slow(source) ? FINDING_PROBLEM : FINDING_OK, "clock source");
	doctor_say(finding->measured, "%s", source);
	doctor_say(finding->limit, "the processor's own counter: tsc, arch_sys_counter, kvm-clock");
	if (is_slow(source))
		doctor_say(finding->remedy,
			   "the kernel found tsc unstable (dmesg | grep -i tsc): update the BIOS, "
			   "switch off its power saving, or boot with tsc=reliable");
}

static void check_reading(struct doctor *doctor)
{
	double read_ns = doctor->facts.clock_read_ns;
	struct finding *finding =
		doctor_find(doctor, read_ns > READ_MAX_NS ? FINDING_PROBLEM : FINDING_OK,
			    "reading CLOCK_MONOTONIC");

	doctor_say(finding->measured, "takes %.0f ns", read_ns);
	doctor_say(finding->limit, "at most %d", READ_MAX_NS);
	if (read_ns > READ_MAX_NS)
		doctor_say(finding->remedy,
			   "pulses and frames get blunt times: see the clock source");
}

static void check_slew(struct doctor *doctor)
{
	double ppm = doctor->facts.clock_slew_ppm;
	bool fast = fabs(ppm) > SLEW_MAX_PPM;
	struct finding *finding =
		doctor_find(doctor, fast ? FINDING_PROBLEM : FINDING_OK, "NTP slews the clock");

	doctor_say(finding->measured, "by %+.1f ppm", ppm);
	doctor_say(finding->limit, "at most %d ppm either way", SLEW_MAX_PPM);
	if (fast)
		doctor_say(finding->remedy, "the time of day is far off or the oscillator is bad: "
					    "let NTP settle before shooting (chronyc tracking)");
}

static void check_utc(struct doctor *doctor)
{
	bool good = doctor->facts.utc_synchronised;
	struct finding *finding =
		doctor_find(doctor, good ? FINDING_OK : FINDING_NOTE, "time of day");

	doctor_say(finding->measured, "%s", good ? "synchronised" : "not synchronised");
	if (!good)
		doctor_say(finding->remedy, "markers do not need it; for the UTC offset of the "
					    "stream: apt install chrony");
}

void doctor_check_clock(struct doctor *doctor)
{
	check_source(doctor);
	check_reading(doctor);
	check_slew(doctor);
	check_utc(doctor);
}
