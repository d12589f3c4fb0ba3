/*
 * Light where it does not belong: each camera's pictures with the strobes lit and dark, twice, so
 * that what changes by itself is not taken for the strobes' doing.
 */
#pragma once

#include "config/stage.h"
#include "ctl/doctor/doctor.h"

#define LIGHT_ROUNDS 2

/* Of some pictures. */
struct light_level {
	double mean_grey; /* 0 to 255 */
	double spots;     /* a picture, outside the camera's mask */
};

struct light_seen {
	struct light_level lit[LIGHT_ROUNDS], dark[LIGHT_ROUNDS];
};

/* Adds what follows from what camera `c` of the config saw. */
void doctor_judge_light(struct doctor *doctor, uint32_t c, const struct light_seen *seen);

/* Opens trigger and cameras of the config, fires, and judges. Takes a second or so per camera. */
void doctor_measure_light(struct doctor *doctor, const struct stage *stage);

/* One camera, running. Returns 0, or a negative errno with a message. */
int light_measure(struct light_level *out, const struct stage *stage, uint32_t c,
		  struct camera *camera, struct diag *diag);
