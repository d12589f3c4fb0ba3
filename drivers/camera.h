/*
 * What a camera driver is: a const table of calls. A driver is one small file that embeds
 * `struct camera` as the first member of its own struct.
 *
 * Threads: list, open, configure, start, stop and close run on the control thread and may block and
 * allocate. acquire and release run on the camera's capture thread, which may not allocate, lock or
 * log. stop is called after the capture thread has ended.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "drivers/pixel_format.h"

/* One exposure, lent by acquire until release. Pixel (0,0) is the centre of the top-left pixel. */
struct frame {
	const uint8_t *pixels; /* the driver's */
	int width_px, height_px, stride_bytes;
	enum pixel_format format;
	int bits;            /* of a grey value: 9 to 16 for PIXEL_GREY16; 0 means 8 */
	size_t size_bytes;   /* of a PIXEL_MJPEG picture; else 0: rows, stride_bytes apart */
	uint64_t shot;       /* when the source numbers its shots (a recording), else UINT64_MAX */
	uint64_t device_seq; /* the device's counter, extended to 64 bits; a gap is a lost frame */
	int64_t mid_exposure_ns; /* CLOCK_MONOTONIC, middle of the time in which light was collected
				  */
	int64_t uncertainty_ns;  /* bound on its error */
	int64_t arrival_ns;      /* CLOCK_MONOTONIC when the last pixel was in memory */
	int64_t row_time_ns;     /* rolling shutter: time between rows; 0 for a global shutter */
	void *token;             /* the driver's own, for release */
};

/* A device's own setting by its own name, for what a mode has no field for. */
struct camera_control {
	char name[64];
	int64_t value;
};

#define CAMERA_CONTROL_MAX 24

enum camera_shutter {
	SHUTTER_UNKNOWN, /* the bound on a frame's time allows for either */
	SHUTTER_GLOBAL,  /* all rows collect light together */
	SHUTTER_ROLLING, /* row after row */
};

/* Of cameras on a network. What cannot be had is done without, and told (camera_driver.facts). */
enum camera_clock {
	CAMERA_CLOCK_DEVICE, /* its own, mapped to ours */
	CAMERA_CLOCK_PTP,    /* kept by IEEE 1588, as the machine's CLOCK_TAI must be too */
};
enum camera_receive {
	CAMERA_RECEIVE_SOCKET,
	CAMERA_RECEIVE_PACKETS, /* a packet socket: less CPU, later */
};

/* Wanted by the caller, then what the device will really do. Zero = the device's own choice. */
struct camera_mode {
	int width_px, height_px;
	enum pixel_format format;
	int bits;          /* as in struct frame */
	int64_t period_ns; /* between frames when it runs free */
	int64_t exposure_ns;
	int64_t readout_ns; /* from the end of the exposure to the last pixel; 0: not known */
	enum camera_shutter shutter;
	int64_t row_time_ns; /* as in struct frame; 0: not known, or global */
	double gain_db;
	enum camera_clock clock;     /* wanted; only of a driver that has_network */
	enum camera_receive receive; /* likewise */
	bool triggered;              /* exposes on a trigger edge, not by its own clock */
	int control_count;
	struct camera_control controls[CAMERA_CONTROL_MAX]; /* set last, in this order */
};

struct camera_info {
	char address[128]; /* driver:rest, as the config wants it */
	char model[64];
	char serial[64];
};

/* What a driver counts of its own, by a name of its own. */
struct camera_count {
	const char *name; /* static */
	uint64_t count;
};

#define CAMERA_COUNT_MAX 16

/* What a driver says of itself in words: which clock counts, how pictures are received. */
struct camera_fact {
	const char *name; /* static */
	char text[120];
	bool falls_short; /* of what was asked for: an operator should know */
};

#define CAMERA_FACT_MAX 8

struct camera_driver;

struct camera {
	const struct camera_driver *driver;
};

typedef void camera_found_fn(const struct camera_info *info, void *user);

struct camera_driver {
	const char *name;  /* the part of an address before the colon */
	bool has_controls; /* else a mode with camera_mode.controls is not handed to it */
	bool has_network;  /* else a mode with another clock or receive than 0 is not */

	/* Calls `found` for every device it can see now. Returns 0 or a negative errno. */
	int (*list)(camera_found_fn *found, void *user, struct diag *diag);

	/* `rest` is the address behind the colon; paths in it are relative to `base_dir` (NULL =
	 * the working directory). On failure: a negative errno, one message in `diag` that names
	 * the device, the cause and the remedy, and `*out` untouched. */
	int (*open)(struct camera **out, const char *rest, const char *base_dir, struct diag *diag);
	void (*close)(struct camera *camera); /* accepts NULL */

	/* Sets what it can and returns what the device will really do. Also again, with another
	 * period and exposure, of a camera that is stopped. */
	int (*configure)(struct camera *camera, const struct camera_mode *wanted,
			 struct camera_mode *granted, struct diag *diag);
	int (*start)(struct camera *camera, struct diag *diag);
	void (*stop)(struct camera *camera);

	/* Waits up to `timeout_ns` for the next frame. Returns 0 and a lent frame, or
	 *   -ETIMEDOUT  nothing came
	 *   -EBADMSG    a frame came damaged and was dropped; go on
	 *   -ENODATA    the recording is over
	 *   -ENODEV     the device is gone for good: stop and close
	 *   others      it is of no more use: stop and close too */
	int (*acquire)(struct camera *camera, int64_t timeout_ns, struct frame *out);
	void (*release)(struct camera *camera, struct frame *frame);

	/* NULL where there are none. Since the last start; returns how many. Control thread. */
	int (*counts)(const struct camera *camera, struct camera_count out[CAMERA_COUNT_MAX]);

	/* Likewise; while it is started. */
	int (*facts)(const struct camera *camera, struct camera_fact out[CAMERA_FACT_MAX]);
};

/* Finds the driver of an address ("sim:ir3") in a program's NULL-terminated list; `rest` gets the
 * part behind the colon. NULL with a message naming the known drivers when there is none. */
const struct camera_driver *camera_driver_find(const struct camera_driver *const *drivers,
					       const char *address, const char **rest,
					       struct diag *diag);
