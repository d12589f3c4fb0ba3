/*
 * A USB device made by a program, through /dev/raw-gadget.
 */
#include "tests/hil/usb_device.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <linux/usb/raw_gadget.h>

#define CONTROL_MAX_BYTES 1024
#define PACKET_MAX_BYTES 512
#define STRING_MAX 126 /* of a descriptor's 255 bytes, two each */

int usb_device_open(int *out_fd, unsigned int bus)
{
	struct usb_raw_init init = {.driver_name = "dummy_udc", .speed = USB_SPEED_HIGH};
	int fd = open("/dev/raw-gadget", O_RDWR | O_CLOEXEC);

	if (fd < 0)
		return -errno;
	snprintf((char *)init.device_name, sizeof(init.device_name), "dummy_udc.%u", bus);
	if (ioctl(fd, USB_RAW_IOCTL_INIT, &init) || ioctl(fd, USB_RAW_IOCTL_RUN)) {
		int err = -errno;

		close(fd);
		return err;
	}
	*out_fd = fd;
	return 0;
}

int usb_device_next_request(int fd, struct usb_ctrlrequest *out)
{
	union {
		struct usb_raw_event event;
		uint8_t bytes[sizeof(struct usb_raw_event) + sizeof(struct usb_ctrlrequest)];
	} in;

	do {
		memset(&in, 0, sizeof(in));
		in.event.length = sizeof(struct usb_ctrlrequest);
		if (ioctl(fd, USB_RAW_IOCTL_EVENT_FETCH, &in))
			return -errno;
	} while (in.event.type != USB_RAW_EVENT_CONTROL);
	memcpy(out, in.event.data, sizeof(*out));
	return 0;
}

static int control(int fd, unsigned long direction, void *data, size_t bytes)
{
	union {
		struct usb_raw_ep_io io;
		uint8_t bytes[sizeof(struct usb_raw_ep_io) + CONTROL_MAX_BYTES];
	} transfer = {.io = {.length = (uint32_t)bytes}};

	if (bytes > CONTROL_MAX_BYTES)
		return -EMSGSIZE;
	if (bytes && direction == USB_RAW_IOCTL_EP0_WRITE)
		memcpy(transfer.io.data, data, bytes);
	if (ioctl(fd, direction, &transfer) < 0)
		return -errno;
	if (bytes && direction == USB_RAW_IOCTL_EP0_READ)
		memcpy(data, transfer.io.data, bytes);
	return 0;
}

int usb_device_reply(int fd, const struct usb_ctrlrequest *request, const void *data, size_t bytes)
{
	return control(fd, USB_RAW_IOCTL_EP0_WRITE, (void *)data,
		       bytes < request->wLength ? bytes : request->wLength);
}

int usb_device_receive(int fd, const struct usb_ctrlrequest *request, void *data, size_t bytes)
{
	return control(fd, USB_RAW_IOCTL_EP0_READ, data,
		       bytes < request->wLength ? bytes : request->wLength);
}

int usb_device_refuse(int fd)
{
	return ioctl(fd, USB_RAW_IOCTL_EP0_STALL) ? -errno : 0;
}

static int reply_string(int fd, const struct usb_ctrlrequest *request, const char *const *strings)
{
	uint8_t reply[2 + 2 * STRING_MAX] = {4, USB_DT_STRING, 0x09, 0x04}; /* 0: US English */
	int wanted = request->wValue & 0xff;

	for (int i = 1; i <= wanted; i++)
		if (!*strings || (i < wanted && !strings[1]))
			return usb_device_refuse(fd);
		else if (i < wanted)
			strings++;
	if (wanted > 0) {
		size_t length = strnlen(*strings, STRING_MAX);

		for (size_t i = 0; i < length; i++) {
			reply[2 + 2 * i] = (uint8_t)(*strings)[i];
			reply[3 + 2 * i] = 0;
		}
		reply[0] = (uint8_t)(2 + 2 * length);
	}
	return usb_device_reply(fd, request, reply, reply[0]);
}

static int reply_descriptor(int fd, const struct usb_ctrlrequest *request,
			    const struct usb_descriptors *descriptors)
{
	switch (request->wValue >> 8) {
	case USB_DT_DEVICE:
		return usb_device_reply(fd, request, &descriptors->device,
					sizeof(descriptors->device));
	case USB_DT_CONFIG:
		return usb_device_reply(fd, request, descriptors->configuration,
					descriptors->configuration_bytes);
	case USB_DT_STRING:
		return reply_string(fd, request, descriptors->strings);
	default:
		return usb_device_refuse(fd);
	}
}

static int configure(int fd, const struct usb_ctrlrequest *request, int (*configured)(void *user),
		     void *user)
{
	int err = configured(user);

	if (err)
		return err;
	if (ioctl(fd, USB_RAW_IOCTL_VBUS_DRAW, 50) || ioctl(fd, USB_RAW_IOCTL_CONFIGURE))
		return -errno;
	return usb_device_receive(fd, request, NULL, 0);
}

int usb_device_answer_standard(int fd, const struct usb_ctrlrequest *request,
			       const struct usb_descriptors *descriptors,
			       int (*configured)(void *user), void *user)
{
	int err;

	if ((request->bRequestType & USB_TYPE_MASK) != USB_TYPE_STANDARD)
		return 0;
	switch (request->bRequest) {
	case USB_REQ_GET_DESCRIPTOR:
		err = reply_descriptor(fd, request, descriptors);
		break;
	case USB_REQ_SET_CONFIGURATION:
		err = configure(fd, request, configured, user);
		break;
	case USB_REQ_SET_INTERFACE:
		err = usb_device_receive(fd, request, NULL, 0);
		break;
	default:
		err = usb_device_refuse(fd);
	}
	return err ? err : 1;
}

int usb_device_enable(int fd, const struct usb_endpoint_descriptor *endpoint)
{
	int handle = ioctl(fd, USB_RAW_IOCTL_EP_ENABLE, endpoint);

	return handle < 0 ? -errno : handle;
}

int usb_device_send(int fd, int endpoint, const void *data, size_t bytes)
{
	struct usb_raw_ep_io *io = malloc(sizeof(*io) + bytes);
	int err = 0;

	if (!io)
		return -ENOMEM;
	*io = (struct usb_raw_ep_io){.ep = (uint16_t)endpoint, .length = (uint32_t)bytes};
	memcpy(io->data, data, bytes);
	if (ioctl(fd, USB_RAW_IOCTL_EP_WRITE, io) < 0)
		err = -errno;
	free(io);
	return err;
}

int usb_device_take(int fd, int endpoint, void *data, size_t bytes)
{
	union {
		struct usb_raw_ep_io io;
		uint8_t bytes[sizeof(struct usb_raw_ep_io) + PACKET_MAX_BYTES];
	} transfer = {.io = {.ep = (uint16_t)endpoint, .length = (uint32_t)bytes}};

	if (bytes > PACKET_MAX_BYTES)
		return -EMSGSIZE;
	int count = ioctl(fd, USB_RAW_IOCTL_EP_READ, &transfer);

	if (count < 0)
		return -errno;
	memcpy(data, transfer.io.data, (size_t)count);
	return count;
}
