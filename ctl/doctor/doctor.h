/*
 * What `stagectl doctor` looks at and what it finds. A check reads files below `root` and the facts
 * of this struct, and adds findings; so tests hand it a machine that is made up.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "config/config.h"

enum finding_level { FINDING_OK, FINDING_NOTE, FINDING_PROBLEM, FINDING_LEVEL_COUNT };

#define FINDING_BYTES 320
#define FINDING_MAX 512 /* a config of 32 cameras makes no more */

struct finding {
	const char *topic; /* static */
	enum finding_level level;
	char what[FINDING_BYTES];     /* "net.core.rmem_max" */
	char measured[FINDING_BYTES]; /* "212992 bytes" */
	char limit[FINDING_BYTES];    /* "at least 8388608"; "" where there is none */
	char remedy[FINDING_BYTES];   /* what to do; "" where there is nothing to do */
};

#define PERSON_GROUP_MAX 128

struct person {
	char name[64];
	uid_t uid;
	uint32_t gid_count;
	gid_t gids[PERSON_GROUP_MAX];
};

/* What a camera of the config sends; zeros where that is not known. */
struct doctor_load {
	uint64_t frame_bytes;
	double bytes_per_s;
};

struct trigger_driver;
struct usb_topology;

/* What no file tells. */
struct doctor_facts {
	struct person asker;
	uint64_t rtprio_max, memlock_max_bytes; /* of this process; UINT64_MAX: no limit */
	double clock_read_ns;
	double clock_slew_ppm; /* of CLOCK_MONOTONIC against its oscillator, by NTP */
	bool utc_synchronised;
	const struct usb_topology *usb;
	const char *recordings_dir; /* where a disk is asked for */
	uint64_t disk_free_bytes;
	double disk_bytes_per_s; /* written there, measured; 0: could not be */
	int disk_error;          /* why not, an errno; 0: it was */
};

struct doctor {
	const char *root;            /* "" on a machine: what /proc, /sys, /dev, /etc lie below */
	const struct config *config; /* NULL: none was named */
	struct doctor_load loads[CAMERA_MAX];
	struct doctor_facts facts;
	const char *topic; /* of the check under way */
	uint32_t finding_count;
	struct finding findings[FINDING_MAX];
};

/* Adds a finding of the check under way, "what" in printf's words; the caller says the rest.
 * Never NULL: beyond FINDING_MAX the last one is written over. */
struct finding *doctor_find(struct doctor *doctor, enum finding_level level, const char *format,
			    ...) __attribute__((format(printf, 3, 4)));
/* Into a field of a finding; what is too long is cut off. */
void doctor_say(char field[FINDING_BYTES], const char *format, ...)
	__attribute__((format(printf, 2, 3)));

const char *finding_level_name(enum finding_level level); /* "ok", "note", "problem" */
uint32_t doctor_count(const struct doctor *doctor, enum finding_level level);
void doctor_print(const struct doctor *doctor);
void doctor_print_json(const struct doctor *doctor);

/* The checks, a file each. */
void doctor_check_system(struct doctor *doctor);
void doctor_check_permissions(struct doctor *doctor);
void doctor_check_realtime(struct doctor *doctor);
void doctor_check_clock(struct doctor *doctor);
void doctor_check_strobe(struct doctor *doctor);
void doctor_check_usb(struct doctor *doctor);
void doctor_check_disk(struct doctor *doctor);
void doctor_check_network(struct doctor *doctor);

/* Is a camera of the config, or its trigger, of this driver? */
bool doctor_uses(const struct doctor *doctor, const char *driver);

/* Of the config's trigger, and the rest of its address. NULL without a config, and when there is
 * none of its name. */
const struct trigger_driver *doctor_trigger(const struct doctor *doctor, const char **rest);
