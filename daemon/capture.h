/*
 * One camera: its capture thread takes frames, finds the spots and queues blob sets for the solver.
 * Pixels never leave that thread, but for a copy into the preview slot when asked.
 */
#pragma once

#include <stdatomic.h>

#include "base/clock.h"
#include "base/handover.h"
#include "base/ring.h"
#include "config/config.h"
#include "daemon/hd_capture.h"
#include "daemon/pictures_share.h"
#include "daemon/realtime.h"
#include "drivers/open_cameras.h"
#include "track/blobs/blobs.h"

enum capture_state {
	CAPTURE_STOPPED,
	CAPTURE_RUNNING,
	CAPTURE_ENDED, /* the recording is over */
	CAPTURE_LOST,  /* the device is gone; reopened from the control side */
};

#define CAPTURE_WHY_BYTES 200

enum preview_state { PREVIEW_NONE, PREVIEW_WANTED, PREVIEW_READY };

/* One frame and its blobs, copied on request. */
struct preview {
	_Atomic int state; /* control: NONE/READY -> WANTED; capture: WANTED -> READY */
	uint8_t *pixels;   /* rows without padding; owned, room for one frame as granted; NULL for
			    * HD: its newest frame is in the pool */
	size_t capacity_bytes, size_bytes;
	int width_px, height_px;
	enum pixel_format format;
	struct blob_set set;
};

/* All since the start; any thread reads them. Each frame that is not in a shot is in one of them.
 */
struct capture_counters {
	_Atomic uint64_t frames;       /* came whole */
	_Atomic uint64_t blobs;        /* found in them */
	_Atomic uint64_t blobs_masked; /* of them, in the mask */
	_Atomic uint64_t blobs_lost;   /* beyond what a set holds */
	_Atomic uint64_t damaged;      /* the driver dropped them as broken */
	_Atomic uint64_t wrong_size;   /* of another size or format than granted */
	_Atomic uint64_t wrong_time;   /* exposed more than a second from their arrival, or half a
					  period from the others of their shot */
	_Atomic uint64_t timeouts;     /* waits in which nothing came */
	_Atomic uint64_t device_gaps;  /* frames that the device counted and did not deliver */
	_Atomic uint64_t refused;      /* no room: the solver, or who reads HD frames, stalled */
	_Atomic uint64_t before_start; /* came before all cameras ran */
	_Atomic uint64_t stale;        /* counted by the solver: came after their shot was closed */
	_Atomic uint64_t missing;      /* counted by the solver: shots without this camera */
	_Atomic uint64_t reopened;     /* times the device was lost and came back */
};

struct capture {
	/* set before the thread starts */
	char name[NAME_BYTES];
	enum camera_role role;
	struct open_camera device;
	int64_t own_exposure_ns;             /* that it was granted first */
	struct blob_finder *finder;          /* owned; NULL for HD */
	struct clock_semaphore *solver_wake; /* borrowed */
	int control_wake_fd;                 /* eventfd, borrowed */
	struct pictures *pictures;           /* borrowed; NULL unless all pictures are offered */
	uint32_t index;                      /* among them: of the config's cameras */

	/* control thread */
	struct realtime_thread thread;
	bool damage_told;     /* logged once; the counters tell how much */
	uint32_t events_told; /* of the ledger, by bit; likewise */
	int64_t lost_since_ns;
	struct mask *mask, *mask_before;  /* owned; the one before until the thread took this */
	char lost_why[CAPTURE_WHY_BYTES]; /* the latest reason that it is not there */

	struct handover masks; /* of const struct mask, control to capture thread */

	/* capture thread */
	const struct mask *mask_in_use;
	bool has_seq;
	uint64_t last_seq;

	struct ring sets;     /* of blob_set, capture thread to solver */
	struct hd_capture hd; /* of an HD camera: its frames */
	struct preview preview;
	_Atomic int state;      /* enum capture_state */
	_Atomic int lost_error; /* what acquire said when the device was lost */
	_Atomic bool stopping;
	struct capture_counters counters;
};

/* Takes over the open device. `queue_length`: blob sets to hold while the solver stalls. Returns 0
 * or -ENOMEM, with the device left to the caller. Control thread, as all below. */
int capture_init(struct capture *capture, const struct config_camera *camera,
		 const struct open_camera *device, const struct blob_settings *settings,
		 uint32_t queue_length);
void capture_finish(struct capture *capture); /* closes the device; a zeroed capture is fine */

/* Counts anew and drops what is queued. */
void capture_begin_run(struct capture *capture);

/* Spots in these areas do not count from the next frame on. Returns 0, -ENOMEM, or -EBUSY while the
 * thread has not yet seen the mask before. */
int capture_set_mask(struct capture *capture, const struct mask *mask);

/* Says that the device is gone, and why. The thread must not run. */
void capture_lose(struct capture *capture, const char *why);

/* Before it starts: configures the device anew when another period or exposure is wanted of it than
 * it has. Returns 0, -EINVAL when its images would change, or what the device says; each with a
 * message. */
int capture_set_light(struct capture *capture, const struct camera_mode *wanted, struct diag *diag);

/* Starts the device and the thread. Returns 0 or a negative errno with a message. */
int capture_start(struct capture *capture, struct diag *diag);

/* Tells the thread to end, without waiting for it: for several at once, before the first stop. */
void capture_tell_to_stop(struct capture *capture);

/* Ends the thread, also one that ended by itself, and stops the device. False when the thread hangs
 * in its driver: then the camera stays as it is, and may be neither finished nor started. */
bool capture_stop(struct capture *capture);

/* Asks for one frame; preview.state becomes PREVIEW_READY and control_wake_fd is written. */
void capture_request_preview(struct capture *capture);
