/*
 * The drivers that stagectl is built with.
 */
#pragma once

#include "drivers/camera.h"
#include "drivers/trigger.h"

/* NULL-terminated. */
extern const struct camera_driver *const live_drivers[];      /* for camera list, show, preview */
extern const struct trigger_driver *const live_triggers[];    /* what a station can be told */
extern const struct camera_driver *const recording_drivers[]; /* as fast as they are read */
