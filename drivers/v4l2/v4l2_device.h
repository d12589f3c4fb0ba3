/*
 * Shared by the files of the v4l2 driver only: finding and opening a device, its mode, its
 * controls, which the libcamera driver sets on its sensors too. All of it for the control thread.
 */
#pragma once

#include <linux/videodev2.h>
#include <stdbool.h>
#include <stdint.h>

#include "drivers/camera.h"

struct v4l2_device {
	int fd;
	uint32_t type;     /* V4L2_BUF_TYPE_VIDEO_CAPTURE, or _MPLANE */
	char address[160]; /* for messages: `v4l2:rest`, and the node where that is another name */
	struct v4l2_capability about;
};

/* How the pictures lie in the device's buffers. */
struct v4l2_layout {
	size_t size_bytes; /* least that a buffer must have */
	int stride_bytes;
	bool takes_luma; /* YUYV of which only the grey is wanted */
};

struct v4l2_buffers {
	uint32_t count;
	uint8_t *pixels[VIDEO_MAX_FRAME]; /* the kernel's, mapped */
	size_t size_bytes[VIDEO_MAX_FRAME];
};

/* ioctl() that goes on after a signal: 0 or a negative errno. Real-time safe. */
int v4l2_ask(int fd, unsigned long request, void *argument);

int v4l2_list(camera_found_fn *found, void *user, struct diag *diag);

/* -ENODEV, -EACCES, -EBUSY, -ENOTSUP or another negative errno with one message. */
int v4l2_open_device(struct v4l2_device *out, const char *rest, struct diag *diag);

/* Adds one message, device, what was being done, cause and remedy; returns `error`. */
int v4l2_fail(const struct v4l2_device *device, int error, const char *doing, struct diag *diag);

/* As camera_driver.configure. */
int v4l2_configure_device(const struct v4l2_device *device, const struct camera_mode *wanted,
			  struct camera_mode *granted, struct v4l2_layout *layout,
			  struct diag *diag);

/* Exposure and gain: those of `wanted` that are not 0 are set. */
int v4l2_set_light(const struct v4l2_device *device, const struct camera_mode *wanted,
		   struct diag *diag);
int64_t v4l2_exposure_ns(const struct v4l2_device *device); /* 0: automatic, or not told */
/* From row to row, where the device tells how its sensor is read; else 0. */
int64_t v4l2_row_time_ns(const struct v4l2_device *device, int width_px);

/* Sets wanted->controls in their order; `granted` gets the values that the device took. */
int v4l2_set_controls(const struct v4l2_device *device, const struct camera_mode *wanted,
		      struct camera_mode *granted, struct diag *diag);

/* A quarter of a second of them, each of at least `least_bytes`. The device is this program's from
 * then on: the kernel gives buffers to one at a time. Into zeroed `buffers`; -EBUSY and others. */
int v4l2_map_buffers(const struct v4l2_device *device, int64_t period_ns, size_t least_bytes,
		     struct v4l2_buffers *buffers, struct diag *diag);
void v4l2_unmap_buffers(const struct v4l2_device *device, struct v4l2_buffers *buffers);

/* Of a buffer in what the device lets be mapped. */
struct v4l2_place {
	uint32_t offset_bytes;
	size_t size_bytes;
};

/* A buffer that came back with a picture. */
struct v4l2_filled {
	uint32_t index, flags, sequence;
	size_t used_bytes;   /* to the picture's end; 0: not told */
	size_t offset_bytes; /* of the picture's beginning */
	int64_t stamp_ns;
};

/* 0 or a negative errno; the latter two are real-time safe. */
int v4l2_query_buffer(const struct v4l2_device *device, uint32_t index, struct v4l2_place *out);
int v4l2_queue(const struct v4l2_device *device, uint32_t index);
int v4l2_dequeue(const struct v4l2_device *device, struct v4l2_filled *out);

/* VIDIOC_G_FMT or VIDIOC_S_FMT. With more than one plane `pix` has the rows of the first. */
int v4l2_ask_format(const struct v4l2_device *device, unsigned long request,
		    struct v4l2_pix_format *pix, uint32_t *plane_count);

/* True when what the device calls the start of the exposure is the coming of the first bytes. */
bool v4l2_stamps_first_bytes(const struct v4l2_device *device);
