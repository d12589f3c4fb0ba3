/*
 * Looks at all that is plugged in for adapters, and for what people take for one.
 */
#include <stdio.h>
#include <string.h>

#include "drivers/usb/ft232h_device.h"

#define VENDOR 0x0403
#define PRODUCT 0x6014
#define RELEASE 0x0900
#define PORTS_MAX 7

static void name_port(libusb_device *device, char *name)
{
	uint8_t ports[PORTS_MAX];
	int count = libusb_get_port_numbers(device, ports, PORTS_MAX);
	int used = snprintf(name, FT232H_NAME_BYTES, "%d", libusb_get_bus_number(device));

	for (int i = 0; i < count; i++)
		used += snprintf(name + used, (size_t)(FT232H_NAME_BYTES - used), "%c%d",
				 i ? '.' : '-', ports[i]);
}

static void look_at_other(const struct ft232h_look *look, libusb_device *device, uint16_t product)
{
	char port[FT232H_NAME_BYTES], text[2 * FT232H_NAME_BYTES];
	const char *kind = product == 0x6001   ? "FT232R"
			   : product == 0x6010 ? "FT2232"
			   : product == 0x6011 ? "FT4232"
			   : product == 0x6015 ? "FT-X"
					       : "FTDI device";

	name_port(device, port);
	snprintf(text, sizeof(text), "%s (0403:%04x) at %s", kind, product, port);
	look->other(look->user, text);
}

static void look_at_adapter(const struct ft232h_look *look, libusb_device *device,
			    const struct libusb_device_descriptor *about)
{
	struct ft232h_info info = {0};
	libusb_device_handle *handle = NULL;

	name_port(device, info.port);
	info.error = ft232h_errno(libusb_open(device, &handle));
	if (!info.error && about->iSerialNumber &&
	    libusb_get_string_descriptor_ascii(handle, about->iSerialNumber,
					       (unsigned char *)info.serial,
					       sizeof(info.serial)) < 0)
		info.serial[0] = 0;
	look->adapter(look->user, &info, handle);
}

int ft232h_look_around(libusb_context *context, const struct ft232h_look *look)
{
	libusb_device **devices;
	ssize_t count = libusb_get_device_list(context, &devices);

	if (count < 0)
		return ft232h_errno((int)count);
	for (ssize_t i = 0; i < count; i++) {
		struct libusb_device_descriptor about;

		if (libusb_get_device_descriptor(devices[i], &about) || about.idVendor != VENDOR)
			continue;
		if (about.idProduct == PRODUCT && about.bcdDevice == RELEASE)
			look_at_adapter(look, devices[i], &about);
		else
			look_at_other(look, devices[i], about.idProduct);
	}
	libusb_free_device_list(devices, 1);
	return 0;
}

/* Who is told of adapters. */
struct listener {
	void (*found)(const struct ft232h_info *info, void *user);
	void *user;
};

static void tell(void *user, const struct ft232h_info *info, libusb_device_handle *handle)
{
	const struct listener *listener = user;

	if (handle)
		libusb_close(handle);
	listener->found(info, listener->user);
}

static void pass_over(void *user, const char *name)
{
	(void)user;
	(void)name;
}

int ft232h_list(void (*found)(const struct ft232h_info *info, void *user), void *user,
		const char *who, struct diag *diag)
{
	struct listener listener = {found, user};
	const struct ft232h_look look = {tell, pass_over, &listener};
	libusb_context *context = NULL;
	int err = ft232h_errno(libusb_init(&context));

	if (!err) {
		err = ft232h_look_around(context, &look);
		libusb_exit(context);
	}
	if (err)
		diag_add(diag, "%s: no USB on this machine: %s", who, strerror(-err));
	return err;
}
