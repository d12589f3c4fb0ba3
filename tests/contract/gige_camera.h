/*
 * The aravis driver on a simulated camera, for tests.
 */
#pragma once

#include "drivers/aravis/aravis.h"
#include "tests/contract/gige_child.h"

/* They print what the driver says, and fail the test where it fails. */
struct camera *gige_camera_open(const struct gige_child *child, uint32_t index);
struct camera_mode gige_camera_start(struct camera *camera, bool triggered);
void gige_camera_stop(struct camera *camera); /* and closes it */

/* One of the driver's own counts; -1 when there is none of this name. */
int64_t gige_camera_count(const struct camera *camera, const char *name);
