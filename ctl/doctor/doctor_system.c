/*
 * Whether the kernel's own files are there: without them little can be said, and much not work.
 */
#include "ctl/doctor/doctor.h"
#include "ctl/doctor/doctor_tree.h"

static void check_mount(struct doctor *doctor, const char *place, const char *inside,
			const char *remedy)
{
	bool there = tree_exists(doctor, inside);
	struct finding *finding =
		doctor_find(doctor, there ? FINDING_OK : FINDING_PROBLEM, "%s", place);

	doctor_say(finding->measured, there ? "mounted" : "not mounted");
	if (!there)
		doctor_say(finding->remedy, "what is said below lacks what it tells: %s", remedy);
}

void doctor_check_system(struct doctor *doctor)
{
	check_mount(doctor, "/proc", "/proc/sys/kernel", "mount -t proc proc /proc");
	check_mount(doctor, "/sys", "/sys/devices/system", "mount -t sysfs sysfs /sys");
}
