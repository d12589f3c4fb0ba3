/*
 * The list that the design keeps out of drivers/, so that sim stays above drivers.
 */
#include "daemon/program_drivers.h"

#include <stddef.h>

#include "drivers/aravis/aravis.h"
#include "drivers/files/files.h"
#include "drivers/gpio/trigger_gpio.h"
#include "drivers/libcamera/libcamera.h"
#include "drivers/trigger_free.h"
#include "drivers/usb/trigger_usb.h"
#include "drivers/v4l2/v4l2.h"
#include "sim/world/world.h"

const struct camera_driver *const camera_drivers[] = {
	&aravis_camera_driver, &files_camera_driver, &libcamera_camera_driver,
	&sim_camera_driver,    &v4l2_camera_driver,  NULL,
};

const struct trigger_driver *const trigger_drivers[] = {
	&free_trigger_driver, &gpio_trigger_driver, &sim_trigger_driver, &usb_trigger_driver, NULL,
};
