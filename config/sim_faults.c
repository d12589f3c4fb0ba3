/*
 * Reads what to do wrong, by camera and scene time.
 */
#include "config/sim_faults.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "config/config.h"
#include "config/config_camera.h"
#include "config/yaml.h"

static const char *const kinds[] = {
	[SIM_FAULT_DROP] = "drop",
	[SIM_FAULT_MISS] = "miss",
	[SIM_FAULT_DELAY] = "delay",
	[SIM_FAULT_REPEAT] = "repeat",
	[SIM_FAULT_SHIFT] = "shift",
	[SIM_FAULT_STAMP_SHIFT] = "stamp_shift",
	[SIM_FAULT_FREEZE] = "freeze",
	[SIM_FAULT_UNPLUG] = "unplug",
	[SIM_FAULT_DARK] = "dark",
	[SIM_FAULT_PHASE_SLIP] = "phase_slip",
	[SIM_FAULT_STUCK_EXPOSURE] = "stuck_exposure",
	[SIM_FAULT_BUMP] = "bump",
	[SIM_FAULT_CLOCK_STEP] = "clock_step",
	[SIM_FAULT_SLOW_DISK] = "slow_disk",
	[SIM_FAULT_STROBE_LEAK] = "strobe_leak",
	NULL,
};

#define AT(member) offsetof(struct sim_fault, member)

static const struct yaml_key fault_keys[] = {
	{"camera", YAML_NAME, AT(camera), true, .size = NAME_BYTES},
	{"kind", YAML_CHOICE, AT(kind), true, .choices = kinds},
	{"at_s", YAML_DOUBLE, AT(at_s), .min = 0, .max = 1e6, .unit = "seconds"},
	{"for_s", YAML_DOUBLE, AT(for_s), .min = 0, .max = 1e6, .unit = "seconds"},
	{"every", YAML_INT, AT(every), .min = 1, .max = 1e6, .unit = "frames"},
	{"delay_ms", YAML_DOUBLE, AT(delay_ms), .min = 0, .max = 10000, .unit = "milliseconds"},
	{"angle_mrad", YAML_DOUBLE, AT(angle_mrad), .min = 0.001, .max = 500,
	 .unit = "milliradians"},
	{"step_ms", YAML_DOUBLE, AT(step_ms), .min = -10000, .max = 10000, .unit = "milliseconds"},
	{0},
};

static void read_fault(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct sim_faults *faults = target;
	struct sim_fault fault = {.kind = -1,
				  .every = 1,
				  .delay_ms = 40,
				  .angle_mrad = 0.2,
				  .step_ms = 5,
				  .line = value->place.line,
				  .column = value->place.column};

	yaml_read_mapping(yaml, value, fault_keys, &fault, NULL);
	faults->faults[faults->count++] = fault;
}

void sim_faults_read(struct yaml *yaml, const struct yaml_value *value, struct sim_faults *faults)
{
	yaml_read_list(yaml, value, SIM_FAULT_MAX, "faults", read_fault, faults);
}

void sim_fault_check_kind(struct yaml *yaml, const struct sim_fault *fault, enum sim_fault_of of,
			  const char *field)
{
	struct yaml_place place = {fault->line, fault->column};

	if (fault->kind < 0) /* unknown, and said so */
		return;
	if (of != SIM_FAULT_OF_RECORDING && fault->kind == SIM_FAULT_SLOW_DISK)
		yaml_complain(yaml, place, field,
			      "camera '%s' reads no disk: slow_disk is for files: cameras",
			      fault->camera);
	else if (of == SIM_FAULT_OF_RECORDING && fault->kind != SIM_FAULT_SLOW_DISK)
		yaml_complain(
			yaml, place, field,
			"camera '%s' is a recording: of its faults only slow_disk can be made",
			fault->camera);
	else if (of != SIM_FAULT_OF_HD && fault->kind == SIM_FAULT_STROBE_LEAK)
		yaml_complain(yaml, place, field,
			      "camera '%s' is meant to see the strobes: it is no HD camera",
			      fault->camera);
	else if (of != SIM_FAULT_OF_HD && fault->kind == SIM_FAULT_PHASE_SLIP)
		yaml_complain(yaml, place, field,
			      "camera '%s' has no phase to slip from: it is no HD camera",
			      fault->camera);
}

/* The device of a fault: a simulated camera has one behind its driver's name, a recording is known
 * by its own. */
static void finish_fault(struct yaml *yaml, struct sim_fault *fault, const char *field,
			 const struct config_camera *camera)
{
	struct yaml_place place = {fault->line, fault->column};
	bool is_recording = camera && strncmp(camera->address, "files:", 6) == 0;

	if (!camera) {
		yaml_complain(yaml, place, field, "there is no camera '%s'", fault->camera);
		return;
	}
	if (!is_recording && strncmp(camera->address, "sim:", 4) != 0) {
		yaml_complain(
			yaml, place, field,
			"camera '%s' is not simulated: faults are for sim: and files: cameras "
			"alone",
			fault->camera);
		return;
	}
	snprintf(fault->device, sizeof(fault->device), "%.*s", NAME_BYTES - 1,
		 is_recording ? camera->name : camera->address + 4);
	sim_fault_check_kind(yaml, fault,
			     is_recording              ? SIM_FAULT_OF_RECORDING
			     : camera->role == ROLE_HD ? SIM_FAULT_OF_HD
						       : SIM_FAULT_OF_IR,
			     field);
}

void sim_faults_finish(struct yaml *yaml, struct sim_faults *faults,
		       const struct config_camera *cameras, uint32_t camera_count)
{
	for (uint32_t i = 0; i < faults->count; i++) {
		struct sim_fault *fault = &faults->faults[i];
		char field[YAML_FIELD_BYTES];

		snprintf(field, sizeof(field), "sim.faults[%u].camera", i);
		if (!*fault->camera)
			continue;
		int found = camera_find(cameras, camera_count, fault->camera);

		finish_fault(yaml, fault, field, found < 0 ? NULL : &cameras[found]);
	}
}
