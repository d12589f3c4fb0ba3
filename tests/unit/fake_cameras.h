/*
 * Cameras that misbehave on command, in place of a program's list of drivers: `fake:0` to `fake:3`.
 */
#pragma once

#include <stdint.h>

#include "base/clock.h"

#define CAMERA_COUNT 4
#define WIDTH_PX 1280
#define HEIGHT_PX 1024
#define PERIOD_NS (10 * NS_PER_MS)

/* What a fake camera does from now on. */
enum fault {
	FAULT_NONE,
	FAULT_SILENT,  /* nothing comes */
	FAULT_GONE,    /* -ENODEV, and not there to open */
	FAULT_DAMAGED, /* -EBADMSG for every frame */
	FAULT_FOREIGN_CLOCK,
	FAULT_GAPS,   /* the device loses every second frame */
	FAULT_REPEAT, /* every frame comes twice */
	FAULT_OTHER_SIZE,
	FAULT_OVER, /* the recording is over */
};

extern _Atomic int fake_faults[CAMERA_COUNT];
extern _Atomic int fake_open_count;
extern int64_t fake_period_ns; /* granted; 0: the device does not tell */
