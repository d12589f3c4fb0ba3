/*
 * An FT232H for machines without USB: in place of drivers/usb/ft232h.c it plays what it is sent by
 * a clock of its own, and remembers every change of its lines.
 */
#pragma once

#include <stdatomic.h>
#include <stdint.h>

#define FAKE_FT232H_CHANGES 8192
#define FAKE_FT232H_ENV "FAKE_FT232H" /* a file that a test in another process maps too */

struct fake_ft232h_change {
	int64_t sample, time_ns; /* CLOCK_MONOTONIC, in truth */
	uint8_t levels;
};

extern struct fake_ft232h {
	/* set by the test */
	_Atomic int gone;              /* 1: unplugged */
	_Atomic int64_t deaf_until_ns; /* until then the station's thread stands still */
	double ppm;                    /* what its quartz is too fast */
	const char *levels_path;       /* reads 0 while its last byte is dark; NULL: nowhere */
	/* told to it */
	_Atomic int change_count;
	struct fake_ft232h_change changes[FAKE_FT232H_CHANGES];
	_Atomic int gap_count; /* that it had no samples, the beginnings included */
	_Atomic int lit_count; /* packets that ended lit */
} * fake_ft232h;

/* As it was at first. While no adapter is open. */
void fake_ft232h_reset(void);
