/*
 * Opens the cameras of a config: finds each one's driver, configures it and checks that its images
 * fit the rig. All of them or none.
 */
#pragma once

#include "config/stage.h"
#include "drivers/camera.h"

struct open_camera {
	const struct camera_driver *driver;
	struct camera *camera; /* NULL when not open */
	struct camera_mode wanted, granted;
};

/* Opens camera `index` of the config, to wait for edges where the trigger `fires` (bits of enum
 * trigger_fires; 0 for recordings) cameras of its role. Returns 0 or a negative errno (-EINVAL: its
 * images do not fit) with a message; `*out` untouched on failure. Control thread. */
int open_camera_by_config(struct open_camera *out, const struct stage *stage, uint32_t index,
			  const struct camera_driver *const *drivers, uint32_t fires,
			  struct diag *diag);

/* Opens those of `camera_mask` into `out[config.camera_count]`. Tries every one, so that one run
 * reports every error; returns the first error, with all closed again. */
int open_cameras(struct open_camera *out, const struct stage *stage, uint32_t camera_mask,
		 const struct camera_driver *const *drivers, uint32_t fires, struct diag *diag);
void close_cameras(struct open_camera *cameras, uint32_t count);

/* The median of the periods that those of `camera_mask` were granted: one that is wrong about its
 * own (a recording that begins with a dropped frame) is outvoted. 0 when none knows. */
int64_t open_cameras_period_ns(const struct open_camera *cameras, uint32_t camera_mask);
