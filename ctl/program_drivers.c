/*
 * As the station's own list, and recordings read as fast as they come.
 */
#include "ctl/program_drivers.h"

#include <stddef.h>

#include "drivers/aravis/aravis.h"
#include "drivers/files/files.h"
#include "drivers/gpio/trigger_gpio.h"
#include "drivers/libcamera/libcamera.h"
#include "drivers/trigger_free.h"
#include "drivers/usb/trigger_usb.h"
#include "drivers/v4l2/v4l2.h"
#include "sim/world/world.h"

const struct camera_driver *const live_drivers[] = {
	&aravis_camera_driver, &files_camera_driver, &libcamera_camera_driver,
	&sim_camera_driver,    &v4l2_camera_driver,  NULL,
};

const struct trigger_driver *const live_triggers[] = {
	&free_trigger_driver, &gpio_trigger_driver, &sim_trigger_driver, &usb_trigger_driver, NULL,
};

const struct camera_driver *const recording_drivers[] = {
	&files_camera_driver_unpaced,
	NULL,
};
