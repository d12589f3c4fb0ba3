/*
 * What drivers/camera.h promises, as tests of any driver.
 */
#pragma once

#include "drivers/camera.h"

struct camera_contract {
	const struct camera_driver *driver;
	const char *rest;     /* an address that works, behind the colon */
	const char *bad_rest; /* one that does not */
	const char *base_dir;
	enum pixel_format format; /* asked for and granted */
	int64_t period_ns;        /* asked for; 0: the device's choice */
	int width_px, height_px;  /* ... */
	bool live;                /* frames bear the clock of now; else the times of a recording */
	int frame_count;          /* frames to take; a recording has at least so many */
};

/* Runs every test; returns how many failed. TAP goes to standard output. */
int camera_contract_run(const struct camera_contract *contract);
