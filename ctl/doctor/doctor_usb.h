/*
 * What is plugged into which USB bus, and which of it the config means.
 */
#pragma once

#include "ctl/doctor/doctor.h"

#define USB_DEVICE_MAX 256
#define USB_NONE UINT32_MAX

struct usb_device {
	char name[40]; /* as in /sys/bus/usb/devices: "1-2.3", of a bus's root "usb1" */
	char serial[64];
	int speed_mbit; /* of its link to the hub above; 0: not known */
	uint16_t vendor, product;
	uint16_t version; /* of USB, as it says itself: 0x0210 */
	bool is_vision;   /* a USB3 Vision camera */
};

struct usb_topology {
	char error[160]; /* why there is none; "" when all is well */
	uint32_t count;
	struct usb_device devices[USB_DEVICE_MAX];
};

/* By libusb, and serial numbers by the files below root: no device is opened. */
void usb_topology_read(const struct doctor *doctor, struct usb_topology *out);

/* Is `below` plugged into `above`, or the same? Both by their names; anything is below its root. */
bool usb_is_below(const char *below, const char *above);

/* Whether an address is of a driver of USB devices, and no IP address. */
bool usb_may_be_camera(const char *address);

/* The device that camera `c` of the config is; USB_NONE where it is none, or not plugged in. */
uint32_t usb_of_camera(const struct doctor *doctor, uint32_t c);

/* That of a trigger `usb`, by the rest of its address; USB_NONE: no such adapter. */
uint32_t usb_of_trigger(const struct doctor *doctor, const char *rest);
