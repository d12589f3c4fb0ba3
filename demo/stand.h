/*
 * The stand that a demonstration puts up: a directory with rig, layout and config, the simulated
 * cameras, and the station that looks at them.
 */
#pragma once

#include <signal.h>

#include "demo/children.h"
#include "demo/options.h"
#include "sim/world/scene.h"

struct stand {
	char dir[4096];
	char socket_path[4200];
	bool keep_dir;
	struct sim_scene *scene; /* owned */
	int64_t epoch_ns;        /* scene time 0 on CLOCK_MONOTONIC */
	uint32_t camera_count, hd_count;
	double rate_hz;
	struct child cameras; /* serves GigE Vision; not started for in-process cameras */
	struct child station;
	struct child calibration; /* of a station without a rig */
};

/* The directory and its files; the scene's time begins now. Returns 0 or a negative
 * errno with a message; stand_finish() is due either way. */
int stand_init(struct stand *stand, const struct demo_options *options, struct diag *diag);

/* Starts the cameras, unless they are in the station, and waits until they answer. */
int stand_start_cameras(struct stand *stand, const struct demo_options *options, struct diag *diag,
			const volatile sig_atomic_t *stop);
/* With `idle` it waits to be started. */
int stand_start_station(struct stand *stand, bool idle, struct diag *diag);

/* The path of a program of this build, seen from the build directory. Returns 0 or -ENOENT with a
 * message. */
int stand_program(char *path, size_t size, const char *below_build, struct diag *diag);

/* Ends the children; keeps the files. */
void stand_stop(struct stand *stand);

/* What the GigE Vision cameras say of themselves once they have ended: not the station's doing. */
struct camera_counts {
	uint64_t frames_sent;
	uint64_t frames_late;    /* sent more than a millisecond after their pulse */
	uint64_t frames_skipped; /* never sent, because the simulator was too late */
};

/* False when they are not known. */
bool stand_camera_counts(const struct stand *stand, struct camera_counts *out);

/* stand_stop(), then removes the directory unless it is to be kept. A zeroed stand is fine. */
void stand_finish(struct stand *stand);
