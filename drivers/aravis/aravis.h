/*
 * GigE Vision and USB3 Vision cameras through Aravis: `aravis:` and an IP address, a device id as
 * `stagectl camera list` shows it, or a serial number. docs/gige.md has the set-up of a network.
 */
#pragma once

#include "drivers/camera.h"

extern const struct camera_driver aravis_camera_driver;
