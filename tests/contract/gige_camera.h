/*
 * The aravis driver on a simulated camera, for test programs whose argument is the simulator.
 */
#pragma once

#include "drivers/aravis/aravis.h"
#include "tests/contract/gige_child.h"

/* They print what the driver says, and fail the test where it fails. */
struct camera *gige_camera_open(const struct gige_child *child, uint32_t index);
struct camera_mode gige_camera_start(struct camera *camera, bool triggered);
void gige_camera_stop(struct camera *camera); /* and closes it */

/* As acquire(), but passes over frames that came damaged while a thread of this program or of
 * `child` waited for a processor: that is the busy machine's damage, for a socket holds a frame's
 * packets for a millisecond or two. All other damage is returned. */
int gige_camera_acquire(struct camera *camera, const struct gige_child *child, int64_t timeout_ns,
			struct frame *frame);

/* One of the driver's own counts; -1 when there is none of this name. */
int64_t gige_camera_count(const struct camera *camera, const char *name);

extern const char *gige_program;
extern char gige_log_path[]; /* what its children said; the program removes it */

/* From main(): takes the argument and makes the log. Without one it prints how the program is used,
 * and returns -1. */
int gige_take_program(int argc, char **argv);
