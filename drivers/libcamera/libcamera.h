/*
 * Camera driver `libcamera:ID`: cameras whose sensor and image processor libcamera sets up.
 */
#pragma once

#include "drivers/camera.h"

extern const struct camera_driver libcamera_camera_driver;
