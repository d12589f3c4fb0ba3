/*
 * Camera driver `pattern:spot`: a bright spot that moves. The example of writing-a-driver.md.
 */
#pragma once

#include "drivers/camera.h"

extern const struct camera_driver pattern_camera_driver;
