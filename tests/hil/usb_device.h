/*
 * A USB device made by a program: the kernel's raw gadget on a simulated bus (dummy_hcd). The
 * host's side of it is the real driver. Calls block; each endpoint belongs to one thread.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <linux/usb/ch9.h>

struct usb_descriptors {
	struct usb_device_descriptor device;
	const uint8_t *configuration; /* the whole of it, with its interfaces and endpoints */
	size_t configuration_bytes;
	const char *const *strings; /* number 1 on; ASCII; ends with NULL */
};

/* Plugs a high-speed device into bus `bus` of dummy_hcd. Returns 0 or a negative errno. Closing the
 * file, also by dying, unplugs it. */
int usb_device_open(int *out_fd, unsigned int bus);

/* Waits for the next control request. Returns 0 or a negative errno. It must be answered by one of
 * the four calls below. */
int usb_device_next_request(int fd, struct usb_ctrlrequest *out);
int usb_device_reply(int fd, const struct usb_ctrlrequest *request, const void *data, size_t bytes);
int usb_device_receive(int fd, const struct usb_ctrlrequest *request, void *data, size_t bytes);
int usb_device_refuse(int fd);

/* Answers what every device is asked: descriptors, configuration, interface. `configured` is called
 * once the host chose the configuration. Returns 1 when it answered, 0 when the request is the
 * device's own, or a negative errno. */
int usb_device_answer_standard(int fd, const struct usb_ctrlrequest *request,
			       const struct usb_descriptors *descriptors,
			       int (*configured)(void *user), void *user);

/* Returns the endpoint's handle or a negative errno. */
int usb_device_enable(int fd, const struct usb_endpoint_descriptor *endpoint);

/* Waits until the host has taken all of it. -EINTR after a signal: the rest is thrown away. */
int usb_device_send(int fd, int endpoint, const void *data, size_t bytes);

/* Waits for a packet of the host's. Returns its bytes, at most `bytes`, or a negative errno. */
int usb_device_take(int fd, int endpoint, void *data, size_t bytes);
