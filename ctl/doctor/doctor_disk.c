/*
 * Whether recordings of the config's cameras fit through the disk and on to it.
 */
#include <errno.h>
#include <string.h>

#include "ctl/doctor/doctor.h"

#define MARKERS_BYTES_PER_S 4e6 /* the stream, and the spots of all cameras */
#define SPEED_SPARE 1.5
#define MINUTES_MIN 10
#define MINUTES_GOOD 60

/* Of all that a recording holds: HD images, and what was found in IR images. */
static double needed_bytes_per_s(const struct doctor *doctor)
{
	double sum = MARKERS_BYTES_PER_S;

	for (uint32_t c = 0; doctor->config && c < doctor->config->camera_count; c++)
		if (doctor->config->cameras[c].role == ROLE_HD)
			sum += doctor->loads[c].bytes_per_s;
	return sum;
}

static void note_unknown(struct doctor *doctor)
{
	for (uint32_t c = 0; doctor->config && c < doctor->config->camera_count; c++) {
		const struct config_camera *camera = &doctor->config->cameras[c];

		if (camera->role != ROLE_HD || doctor->loads[c].frame_bytes ||
		    strncmp(camera->address, "sim:", 4) == 0 ||
		    strncmp(camera->address, "files:", 6) == 0)
			continue;
		struct finding *finding =
			doctor_find(doctor, FINDING_NOTE, "images of %s", camera->name);
		doctor_say(finding->measured, "of a size that the config does not tell");
		doctor_say(finding->remedy, "not counted; write width and height under the camera");
	}
}

static void check_speed(struct doctor *doctor, double needed)
{
	const struct doctor_facts *facts = &doctor->facts;
	bool good = facts->disk_bytes_per_s >= SPEED_SPARE * needed;
	struct finding *finding = doctor_find(doctor, good ? FINDING_OK : FINDING_PROBLEM,
					      "writing to %s", facts->recordings_dir);

	if (facts->disk_error)
		doctor_say(finding->measured, "not possible: %s", strerror(facts->disk_error));
	else
		doctor_say(finding->measured, "%.0f MB/s", facts->disk_bytes_per_s / 1e6);
	doctor_say(finding->limit, "recordings need %.0f MB/s, and half of that to spare",
		   needed / 1e6);
	if (facts->disk_error == ENOSPC)
		doctor_say(finding->remedy,
			   "make room there, or name another: recordings_dir in the config, or "
			   "--directory DIR");
	else if (facts->disk_error)
		doctor_say(finding->remedy,
			   "make it, let user %s write there, or name another: "
			   "recordings_dir in the config, or --directory DIR",
			   facts->asker.name);
	else if (!good)
		doctor_say(
			finding->remedy,
			"record to an NVMe or SSD of its own, and name it: recordings_dir in the "
			"config (--directory DIR asks another one)");
}

static void check_space(struct doctor *doctor, double needed)
{
	const struct doctor_facts *facts = &doctor->facts;
	double minutes = (double)facts->disk_free_bytes / needed / 60;
	enum finding_level level = minutes < MINUTES_MIN    ? FINDING_PROBLEM
				   : minutes < MINUTES_GOOD ? FINDING_NOTE
							    : FINDING_OK;
	struct finding *finding = doctor_find(doctor, level, "space in %s", facts->recordings_dir);

	doctor_say(finding->measured, "%.1f GB: %.0f minutes of recording",
		   (double)facts->disk_free_bytes / 1e9, minutes);
	doctor_say(finding->limit, "at least %d minutes, better %d", MINUTES_MIN, MINUTES_GOOD);
	if (level != FINDING_OK)
		doctor_say(finding->remedy, "move old takes away, or use a larger disk");
}

void doctor_check_disk(struct doctor *doctor)
{
	double needed = needed_bytes_per_s(doctor);

	note_unknown(doctor);
	check_speed(doctor, needed);
	if (!doctor->facts.disk_error)
		check_space(doctor, needed);
}
