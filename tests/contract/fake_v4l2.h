/*
 * Cameras for tests of the v4l2 driver: fake_v4l2.c stands between it and the kernel. The functions
 * here make the files that are cameras.
 */
#pragma once

#include <stdbool.h>

#define FAKE_V4L2_SPOT_PX 6

/* A new directory for cameras, to which $FAKE_V4L2 then points; without any camera yet. */
void fake_v4l2_begin(void);
void fake_v4l2_end(void);

/* A camera at /dev/videoNUMBER with these settings ("key value" lines, "" for none). It is plugged
 * in where `serial` is NULL or as the USB device of that serial number. */
void fake_v4l2_plug(int number, const char *serial, const char *settings);
void fake_v4l2_unplug(int number);
