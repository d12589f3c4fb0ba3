/*
 * stagectl doctor: what of this machine, and of the devices of a config, would spoil a shooting
 * day. A table of checks; each adds findings.
 */
#include "ctl/doctor/doctor.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/doctor/doctor_gather.h"
#include "ctl/doctor/doctor_light.h"
#include "ctl/doctor/doctor_usb.h"

#define SERVICE_DIR "/var/lib/stage"
#define SERVICE_CONFIG "/etc/stage/stage.yaml"

static const struct {
	const char *topic;
	void (*check)(struct doctor *doctor);
} checks[] = {
	{"system", doctor_check_system},      {"permissions", doctor_check_permissions},
	{"real time", doctor_check_realtime}, {"clock", doctor_check_clock},
	{"network", doctor_check_network},    {"USB", doctor_check_usb},
	{"disk", doctor_check_disk},          {"strobe", doctor_check_strobe},
};

static void run_checks(struct doctor *doctor)
{
	for (size_t k = 0; k < sizeof(checks) / sizeof(checks[0]); k++) {
		doctor->topic = checks[k].topic;
		checks[k].check(doctor);
	}
}

/* What is wrong with layout and rig does not keep the machine from being looked at. */
static void find_bad_files(struct doctor *doctor, const char *what, const struct diag *diag)
{
	const char *line = diag->text ? diag->text : "";

	doctor->topic = "files";
	for (const char *end; (end = strchr(line, '\n')); line = end + 1) {
		struct finding *finding = doctor_find(doctor, FINDING_PROBLEM, "%s", what);

		doctor_say(finding->measured, "%.*s", (int)(end - line), line);
		doctor_say(finding->remedy, "stagectl config check");
	}
}

static void note_rig(struct doctor *doctor, const struct stage *stage)
{
	struct finding *finding;

	doctor->topic = "files";
	finding = doctor_find(doctor, stage->has_rig ? FINDING_OK : FINDING_NOTE, "rig");
	doctor_say(finding->measured, "%s", stage->has_rig ? stage->rig.revision : "there is none");
	if (!stage->has_rig)
		doctor_say(finding->remedy, "stagectl calibrate cameras makes one");
}

/* The config, and what it names as far as that can be loaded. Returns 0 or an exit code after a
 * message. */
static int load(struct doctor *doctor, struct stage *stage, const char *path)
{
	struct diag diag = {0};
	int code = exit_code_of(config_load(&stage->config, path, &diag), EXIT_CODE_BAD_INPUT);

	if (code) {
		diag_print(&diag, stderr);
		find_bad_files(doctor, "config", &diag);
		diag_finish(&diag);
		return code;
	}
	if (stage_load_to_calibrate(stage, path, &diag) == 0)
		note_rig(doctor, stage);
	else
		stage->has_rig = false;
	find_bad_files(doctor, "what the config names", &diag);
	diag_finish(&diag);
	doctor->config = &stage->config;
	doctor_find_loads(doctor->loads, stage);
	return EXIT_CODE_OK;
}

static const char *choose_dir(const char *named, const struct config *config)
{
	if (named)
		return named;
	if (config && *config->recordings_dir)
		return config->recordings_dir;
	if (access(SERVICE_DIR, W_OK) == 0 || !config)
		return access(SERVICE_DIR, F_OK) == 0 ? SERVICE_DIR : ".";
	return config->base_dir;
}

static int examine(struct doctor *doctor, struct stage *stage, const char *path,
		   const char *directory, bool with_light)
{
	static struct usb_topology usb; /* large */
	int code = path ? load(doctor, stage, path) : EXIT_CODE_OK;

	if (code)
		return code;
	doctor_gather(&doctor->facts);
	usb_topology_read(doctor, &usb);
	doctor->facts.usb = &usb;
	doctor->facts.recordings_dir = choose_dir(directory, doctor->config);
	doctor_probe_disk(&doctor->facts);
	run_checks(doctor);
	doctor->topic = "light";
	if (path && with_light)
		doctor_measure_light(doctor, stage);
	return doctor_count(doctor, FINDING_PROBLEM) ? EXIT_CODE_DEVICE : EXIT_CODE_OK;
}

int verb_doctor(const struct verb *verb, int argc, char **argv)
{
	const char *path = NULL, *directory = NULL;
	bool json = false, no_light = false;
	const struct argument arguments[] = {
		{"directory", "DIR",
		 "to which you record (default: recordings_dir of the config, " SERVICE_DIR
		 ", else here)",
		 .text = &directory},
		{"no-light", NULL, "do not open cameras and fire strobes", .flag = &no_light},
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse_optional(verb, arguments, argc, argv, &path);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	if (!path && access(SERVICE_CONFIG, F_OK) == 0)
		path = SERVICE_CONFIG;
	struct doctor *doctor = calloc(1, sizeof(*doctor));
	struct stage *stage = calloc(1, sizeof(*stage));
	int code = EXIT_CODE_INTERNAL;

	if (doctor && stage) {
		doctor->root = "";
		code = examine(doctor, stage, path, directory, !no_light);
		if (json)
			doctor_print_json(doctor);
		else if (code == EXIT_CODE_OK || code == EXIT_CODE_DEVICE)
			doctor_print(doctor);
	}
	if (stage)
		stage_finish(stage);
	free(stage);
	free(doctor);
	return code;
}
