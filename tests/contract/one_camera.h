/*
 * The one camera at a time that a test program has of its driver.
 */
#pragma once

#include "drivers/camera.h"

extern const struct camera_driver *const driver; /* the program's */

/* Of the test that runs: the camera that is open or NULL, what it granted, what was said. */
extern struct camera *camera;
extern struct camera_mode granted;
extern struct diag diag;

/* After each test. */
int one_camera_tear_down(void **state);
void close_camera(void);

/* 0 or the driver's error. A camera that is open stays open, and is configured again. */
int open_and_configure(const char *rest, const struct camera_mode *wanted);

/* The same, and it must start. */
void start_camera(const char *rest, const struct camera_mode *wanted);

/* The driver's next answer but for -ETIMEDOUT; take() wants a frame. As on the capture thread, all
 * of it is in a real-time section. */
int next(struct frame *frame);
void take(struct frame *frame);
void release(struct frame *frame);

/* There is one message and it has each of the words, which end with NULL; it is forgotten. */
void assert_told(const char *first, ...);
