/*
 * A machine for stagectl doctor: a directory in /tmp with the files of /proc, /sys, /dev and /etc
 * that a test writes, and a doctor who looks at it.
 */
#pragma once

#include "ctl/doctor/doctor.h"

struct machine {
	char root[64];
	struct doctor doctor;
	struct config config; /* the doctor's, of no cameras */
};

struct machine *machine_create(void);
void machine_destroy(struct machine *machine);

/* Writes a file below root, and the directories that it takes; its mode is 0644. */
void machine_write(const struct machine *machine, const char *path, const char *text);
void machine_chmod(const struct machine *machine, const char *path, int mode);
/* A link at `path` to `target`, which is below root too. */
void machine_link(const struct machine *machine, const char *path, const char *target);

/* Adds a camera whose images have `frame_bytes`, at the config's 100 Hz. */
void machine_add_camera(struct machine *machine, const char *name, const char *address,
			enum camera_role role, uint64_t frame_bytes);

/* Runs a check from nothing. */
void machine_examine(struct machine *machine, void (*check)(struct doctor *doctor));

/* The finding whose `what` begins so; there must be one, and of the level. It tells what it
 * measured, and unless it is ok a remedy. */
const struct finding *machine_expect(const struct machine *machine, enum finding_level level,
				     const char *what);
void machine_expect_none(const struct machine *machine, const char *what);
