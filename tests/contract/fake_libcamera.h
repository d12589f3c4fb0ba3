/*
 * Stands in for drivers/libcamera/libcamera_shim.cpp: one camera without libcamera, on a thread of
 * its own, that does what a test asks for. Its picture: byte i of row y of frame n is n + y + i.
 */
#pragma once

#include <stdatomic.h>

#include "drivers/libcamera/libcamera_shim.h"

#define FAKE_ID "/base/i2c@1/fake@10"
#define FAKE_FORMATS 4
#define FAKE_TRUTHS 512

/* Set before the camera is opened; begins with fake_libcamera_begin(). */
struct fake_libcamera {
	const char *id, *model;
	const char *formats[FAKE_FORMATS]; /* libcamera's names */
	bool processed;                    /* they are of no raw stream */
	int width_px, height_px;           /* the one size */
	int stride_bytes;
	bool busy, unseen;
	double low[LIBCAMERA_SETTING_COUNT], high[LIBCAMERA_SETTING_COUNT]; /* 0: no such */
	int64_t readout_ns, rows_ns;
	bool stamps_exposure, stamps_end; /* what it stamps; else the beginning of the read-out */
	int64_t stamp_offset_ns;          /* of its clock */
	uint32_t lose_every, damage_every;
	_Atomic bool cancels; /* every request from now on */

	/* what the driver did */
	struct libcamera_light light;
	int stops, closes, abandons;
	int64_t truth_ns[FAKE_TRUTHS]; /* middle of the middle row's exposure, by sequence */
};

extern struct fake_libcamera fake;

void fake_libcamera_begin(void);
void fake_libcamera_unplug(void);

/* The fake's own mapping of a buffer, by what the driver calls it. */
uint8_t *fake_libcamera_pixels(uint32_t buffer);
