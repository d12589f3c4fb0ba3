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
