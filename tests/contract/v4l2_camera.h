/*
 * One fake V4L2 camera and the driver on it, for tests.
 */
#pragma once

#include "drivers/v4l2/v4l2.h"
#include "tests/contract/fake_v4l2.h"
#include "tests/contract/one_camera.h"

extern const struct camera_mode grey; /* a mode that leaves all to the device */

int v4l2_set_up(void **state);
int v4l2_tear_down(void **state);

/* Plugs a camera in at /dev/video0 and starts it. */
void begin(const char *settings, const struct camera_mode *wanted);

#define V4L2_TEST(name) cmocka_unit_test_setup_teardown(name, v4l2_set_up, v4l2_tear_down)
