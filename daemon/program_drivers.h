/*
 * The drivers that staged is built with. NULL-terminated lists.
 */
#pragma once

#include "drivers/camera.h"
#include "drivers/trigger.h"

extern const struct camera_driver *const camera_drivers[];
extern const struct trigger_driver *const trigger_drivers[];
