/*
 * Shared by the files of the libcamera driver only: finding a camera, its mode, its sensor. All of
 * it for the control thread.
 */
#pragma once

#include "drivers/camera.h"
#include "drivers/libcamera/libcamera_format.h"
#include "drivers/libcamera/libcamera_shim.h"

/* A camera that is open, for the calls below. */
struct libcamera_at {
	struct libcamera_device *device;
	char id[128];
	char address[160]; /* for messages: `libcamera:rest` */
	char sensor[80]; /* directory of its sensor's sub-device in /sys; "" where there is none */
};

int libcamera_list(camera_found_fn *found, void *user, struct diag *diag);

/* -ENODEV, -EACCES, -EBUSY or another negative errno with one message. */
int libcamera_open_device(struct libcamera_at *out, const char *rest, struct diag *diag);

/* Adds one message, device, what was being done, cause and remedy; returns `error`. */
int libcamera_fail(const struct libcamera_at *at, int error, const char *doing, struct diag *diag);

/* As camera_driver.configure; `light` is for the start. */
int libcamera_configure_device(const struct libcamera_at *at, const struct camera_mode *wanted,
			       struct camera_mode *granted, struct libcamera_stream *stream,
			       const struct libcamera_format **format,
			       struct libcamera_light *light, struct diag *diag);

/* The directory of a sensor's sub-device in /sys; false when there is none. */
bool libcamera_find_sensor(const char *id, char *directory, size_t size);

/* Of the sensors that are known. */
enum camera_shutter libcamera_sensor_shutter(const char *model);

/* The sensor's own: makes it wait for edges of its trigger input, or not, and sets
 * wanted->controls; granted->row_time_ns gets the time between its rows where it tells. -ENOTSUP:
 * it has no such thing. */
int libcamera_set_sensor(const struct libcamera_at *at, const struct camera_mode *wanted,
			 struct camera_mode *granted, struct diag *diag);
