/*
 * The station's configuration: one YAML file that names rig, layout and cameras. Everything else
 * has a default. docs/configuration.md lists every key.
 */
#pragma once

#include <limits.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "config/calibration.h"
#include "config/sim_faults.h"
#include "drivers/camera.h"
#include "drivers/trigger.h"
#include "track/blobs/blobs.h"
#include "track/blobs/mask.h"
#include "track/layout.h"
#include "track/tracker.h"

enum camera_role { ROLE_IR, ROLE_HD };

/* Of the whole station; docs/architecture.md, "Virtual time". */
enum sim_clock { SIM_CLOCK_REAL, SIM_CLOCK_VIRTUAL, SIM_CLOCK_STEPPED };

struct config_camera {
	char name[NAME_BYTES];
	char address[256]; /* driver:rest; paths in it are relative to base_dir */
	enum camera_role role;
	struct camera_mode wanted; /* zero fields: the device's own choice */
	bool has_format;           /* the format is written down; else any that serves */
	struct mask mask;          /* spots there do not count */
	double electrons_per_grey; /* of its sensor; 0: that of `blobs` */
	int line, column;          /* of the camera in the file, for messages */
};

struct config {
	char path[PATH_MAX];
	char base_dir[PATH_MAX]; /* the directory that relative paths start from */
	char rig_dir[PATH_MAX];
	uint32_t layout_count; /* at least one; an actor each */
	char layout_paths[ACTOR_MAX][PATH_MAX];
	char socket_dir[PATH_MAX];            /* stream.sock and control.sock; default /run/stage */
	char recordings_dir[PATH_MAX];        /* doctor's; "" when the config does not say */
	char trigger[256];                    /* address; default "free" */
	struct trigger_plan plan;             /* period from rate_hz (default 120) */
	struct trigger_plan calibration_plan; /* while calibrating */
	int64_t strobe_one_shot_ns;           /* of its hardware, as the operator says; 0: unsaid */
	bool strobe_pull_down;                /* ... has one, as the operator says */
	uint32_t camera_count;
	struct config_camera cameras[CAMERA_MAX];
	char masks_path[PATH_MAX]; /* "" for none */
	struct blob_settings blobs;
	struct tracker_settings tracking;
	struct calibration calibration;
	/* only for sim: cameras */
	char sim_scene[PATH_MAX]; /* a scene's name or file; default "talking" */
	uint64_t sim_seed;
	int64_t sim_epoch_ns; /* scene time 0 on the station's clock; 0 = when the daemon starts */
	enum sim_clock sim_clock;
	int sim_clock_line, sim_clock_column; /* for messages */
	struct sim_faults sim_faults;
};

/* Reads and checks the file alone (not what it names). Every error is one message
 * "file:line:column: field: what is wrong". Returns 0, -EINVAL, or the errno of reading it. */
int config_load(struct config *config, const char *path, struct diag *diag);

/* What the drivers of a program say of addresses: one message for each thing that is wrong, which
 * the config tells behind file, line and column. */
struct config_drivers {
	void (*camera)(const char *address, struct diag *diag);
	/* of config.trigger; and of its plans, which are only good then */
	void (*trigger)(const struct config *config, bool plans_are_good, struct diag *diag);
};

/* The same, with the drivers asked. */
int config_load_for(struct config *config, const char *path, const struct config_drivers *drivers,
		    struct diag *diag);

/* How blobs are found in a camera's images. */
struct blob_settings config_blobs(const struct config *config, uint32_t camera);
