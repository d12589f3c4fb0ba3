/*
 * Shared by the files of the aravis driver only: finding and opening a device, and its mode.
 */
#pragma once

#include <netinet/in.h>
#include <stdbool.h>
#include <stdint.h>

#include <arv.h>

#include "base/diag.h"
#include "drivers/camera.h"

int aravis_list(camera_found_fn *found, void *user, struct diag *diag);

/* Opens the device and takes control of it. `address` is `aravis:rest`, for messages. -ENODEV,
 * -EHOSTUNREACH, -EACCES, -EBUSY or -EIO with one message. */
int aravis_open_device(ArvCamera **out, const char *address, const char *rest, struct diag *diag);

/* Whether a camera answers at this address: 0, -ECONNREFUSED (a machine, but no camera), -ETIMEDOUT
 * after 0.9 s, or why there is no way there. Any thread. */
int aravis_probe(struct in_addr ip);

/* One of GenICam's pixel formats that is one of ours. */
struct aravis_format {
	ArvPixelFormat code;
	enum pixel_format format;
	int bits; /* as in struct frame */
};

/* Sets the device to the wanted format, or to the best that may stand in for it. -ENOTSUP with the
 * list of what it offers, -EIO. */
int aravis_set_format(ArvCamera *device, const char *address, const struct camera_mode *wanted,
		      struct aravis_format *chosen, struct diag *diag);

/* As camera_driver.configure; also makes the device ready for a stream (packet size). */
int aravis_configure_device(ArvCamera *device, const char *address,
			    const struct camera_mode *wanted, struct camera_mode *granted,
			    ArvPixelFormat *format, struct diag *diag);

/* True when the device stamps the middle of the exposure; the rule is that it stamps the start. */
bool aravis_stamps_middle(ArvCamera *device);

/* The device's clock showed device_ns when ours was within bound_ns of host_ns. */
struct device_clock {
	int64_t device_ns, host_ns, bound_ns;
};

/* The sharpest of `tries` readings; -ENOTSUP when the device has no clock that can be read, -EIO.
 */
int aravis_read_clock(ArvCamera *device, int tries, struct device_clock *out);

/* Of a GigE Vision device. */
struct in_addr aravis_ip(ArvCamera *device);

/* Whether this process may have a packet socket. */
bool aravis_may_have_packets(void);

/* True when the device can send lost packets again. */
bool aravis_resends(ArvCamera *device);

/* Widens the stream's socket so that it holds several frames while the receiver waits its turn, and
 * logs a warning when the kernel grants less than two. */
void aravis_widen_socket(ArvStream *stream, const char *address, size_t payload_bytes);

/* Adds one message from a GLib error, which it clears; returns `error_number`, or -ENODEV where the
 * error says that the device does not answer. */
int aravis_fail(GError **error, int error_number, const char *address, const char *doing,
		struct diag *diag);
