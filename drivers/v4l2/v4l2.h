/*
 * Camera driver `v4l2:/dev/video0`, `v4l2:serial=XYZ` or `v4l2:card=NAME`: USB and other cameras by
 * the kernel's Video4Linux 2. Pixels are read where the kernel puts them; docs/v4l2.md.
 */
#pragma once

#include "drivers/camera.h"

extern const struct camera_driver v4l2_camera_driver;
