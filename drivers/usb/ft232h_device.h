/*
 * An open adapter, for the files of ft232h.
 */
#pragma once

#include <libusb.h>

#include "drivers/usb/ft232h.h"

struct ft232h {
	libusb_context *context;
	libusb_device_handle *handle;
	uint8_t endpoint; /* that takes the bytes */
	uint32_t packet_bytes;
};

int ft232h_errno(int libusb_error);

/* What is made of every device of FTDI's that is plugged in. */
struct ft232h_look {
	/* an adapter; the handle is the callee's, NULL when it cannot be opened */
	void (*adapter)(void *user, const struct ft232h_info *info, libusb_device_handle *handle);
	/* another chip, by its name and place */
	void (*other)(void *user, const char *name);
	void *user;
};

int ft232h_look_around(libusb_context *context, const struct ft232h_look *look);
