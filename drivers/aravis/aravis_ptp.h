/*
 * A camera's clock that is kept by PTP (IEEE 1588). It shows TAI as this machine's CLOCK_TAI does,
 * when both follow one master: that is not believed but looked at, again and again, by readings of
 * the camera's clock between two readings of ours.
 */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include <arv.h>

#include "drivers/camera.h"

struct aravis_ptp {
	/* set by aravis_ptp_set */
	ArvCamera *device;
	bool wanted, on; /* on: the camera was told to follow PTP */

	/* of aravis_ptp_look, on one thread at a time */
	_Atomic int status;      /* index of what the camera says of its PTP */
	_Atomic int error;       /* a negative errno: its clock cannot be read */
	_Atomic int64_t off_ns;  /* of its clock, from ours */
	_Atomic bool usable;     /* the rest holds: */
	_Atomic uint32_t change; /* odd while the next three are written */
	_Atomic int64_t ahead_ns, bound_ns, read_ns;
};

/* Tells the camera to follow PTP, or not. Nothing is said when it has none: aravis_ptp_tell() does.
 * Control thread, while the camera is stopped. */
void aravis_ptp_set(struct aravis_ptp *ptp, ArvCamera *device, enum camera_clock wanted);

/* Looks at its clock and state; takes as long as a few questions. By one thread at a time. */
void aravis_ptp_look(struct aravis_ptp *ptp);

/* CLOCK_MONOTONIC at `device_ns`, and a bound on its error; false when the clock is not one that
 * PTP keeps for both. Real-time safe. */
bool aravis_ptp_host_ns(const struct aravis_ptp *ptp, int64_t device_ns, int64_t *host_ns,
			int64_t *bound_ns);

/* Which clock counts, and why. */
void aravis_ptp_tell(const struct aravis_ptp *ptp, struct camera_fact *out);
