/*
 * One fake V4L2 camera and the driver on it, for tests.
 */
#pragma once

#include "drivers/v4l2/v4l2.h"
#include "tests/contract/fake_v4l2.h"

extern const struct camera_driver *const driver;
extern const struct camera_mode grey; /* a mode that leaves all to the device */

/* Of the test that runs: the camera that is open, what it granted, what was said. */
extern struct camera *camera;
extern struct camera_mode granted;
extern struct diag diag;

int v4l2_set_up(void **state);
int v4l2_tear_down(void **state);

/* 0 or the driver's error. */
int open_and_configure(const char *rest, const struct camera_mode *wanted);

/* Plugs a camera in at /dev/video0 and starts it. */
void begin(const char *settings, const struct camera_mode *wanted);

/* The driver's next answer but for -ETIMEDOUT; take() wants a frame. */
int next(struct frame *frame);
void take(struct frame *frame);

/* There is one message and it has each of the words, which end with NULL; it is forgotten. */
void assert_told(const char *first, ...);

#define V4L2_TEST(name) cmocka_unit_test_setup_teardown(name, v4l2_set_up, v4l2_tear_down)
