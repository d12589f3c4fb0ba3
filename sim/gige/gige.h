/*
 * The scene's cameras as GigE Vision devices on consecutive loopback addresses, served by Aravis'
 * fake camera. One pulse fires them all: every camera shows shot n of the scene, stamped with its
 * true mid-exposure in CLOCK_MONOTONIC nanoseconds. docs/gige.md says how it is done.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "sim/world/scene.h"

struct gige_stage;

/* Over all cameras; a frame is sent to whoever controls the camera. */
struct gige_counts {
	uint64_t sent;
	uint64_t late;    /* sent, but more than a millisecond after its pulse */
	uint64_t skipped; /* shots not shown because the simulator was later than half a period */
};

/* `scene` is borrowed. Camera i gets the IPv4 address `first_address` + i; scene time 0 is at
 * `epoch_ns`. Returns 0, -EINVAL with a message, or -ENOMEM. */
int gige_stage_create(struct gige_stage **out, const struct sim_scene *scene, int64_t epoch_ns,
		      const char *first_address, struct diag *diag);
void gige_stage_destroy(struct gige_stage *stage); /* accepts NULL; stops it first */

struct gige_abilities {
	bool resend;             /* they say that they send lost packets again */
	bool ptp;                /* they follow PTP when they are told to: a master that is */
	int64_t master_ahead_ns; /* ... so far from CLOCK_TAI */
};

/* Opens every camera's control port: from here on receivers find and start them. Returns 0, or a
 * negative errno with one message per camera that cannot be served; then none is. */
int gige_stage_start(struct gige_stage *stage, const struct gige_abilities *abilities,
		     struct diag *diag);
void gige_stage_stop(struct gige_stage *stage);

/* The camera whose control port is `control_fd` has just answered a packet that came at
 * `packet_ns`: if that asked it to latch its clock, which is CLOCK_MONOTONIC, this is what it
 * shows. */
void gige_stage_latch(struct gige_stage *stage, int control_fd, int64_t packet_ns);

struct gige_counts gige_stage_counts(const struct gige_stage *stage); /* any thread */
void gige_stage_image_size(const struct gige_stage *stage, int *width_px, int *height_px);
