/*
 * The tree of USB devices by libusb, which opens none of them for it.
 */
#include <libusb.h>
#include <stdio.h>
#include <string.h>

#include "ctl/doctor/doctor_tree.h"
#include "ctl/doctor/doctor_usb.h"

#define PORTS_MAX 7
#define CLASS_MISC 0xef
#define SUBCLASS_VISION 0x05

static int speed_mbit(enum libusb_speed speed)
{
	switch (speed) {
	case LIBUSB_SPEED_LOW:
		return 1;
	case LIBUSB_SPEED_FULL:
		return 12;
	case LIBUSB_SPEED_HIGH:
		return 480;
	case LIBUSB_SPEED_SUPER:
		return 5000;
	case LIBUSB_SPEED_SUPER_PLUS:
		return 10000;
	default:
		return 0;
	}
}

static void name_device(libusb_device *device, char *name, size_t size)
{
	uint8_t ports[PORTS_MAX];
	int count = libusb_get_port_numbers(device, ports, PORTS_MAX);
	int bus = libusb_get_bus_number(device);
	int used = snprintf(name, size, count > 0 ? "%d-" : "usb%d", bus);

	for (int p = 0; p < count && used >= 0 && (size_t)used < size; p++)
		used += snprintf(name + used, size - (size_t)used, p ? ".%d" : "%d", ports[p]);
}

static bool is_vision(libusb_device *device)
{
	struct libusb_config_descriptor *config;
	bool found = false;

	if (libusb_get_active_config_descriptor(device, &config) < 0)
		return false;
	for (int i = 0; i < config->bNumInterfaces && !found; i++) {
		const struct libusb_interface *interface = &config->interface[i];

		found = interface->num_altsetting > 0 &&
			interface->altsetting->bInterfaceClass == CLASS_MISC &&
			interface->altsetting->bInterfaceSubClass == SUBCLASS_VISION;
	}
	libusb_free_config_descriptor(config);
	return found;
}

static void read_device(const struct doctor *doctor, libusb_device *from, struct usb_device *to)
{
	struct libusb_device_descriptor about;
	int64_t told_mbit;

	*to = (struct usb_device){
		.speed_mbit = speed_mbit((enum libusb_speed)libusb_get_device_speed(from))};
	name_device(from, to->name, sizeof(to->name));
	tree_line(doctor, to->serial, sizeof(to->serial), "/sys/bus/usb/devices/%s/serial",
		  to->name);
	if (tree_number(doctor, &told_mbit, "/sys/bus/usb/devices/%s/speed", to->name))
		to->speed_mbit = (int)told_mbit; /* knows 20 Gbit/s */
	if (libusb_get_device_descriptor(from, &about) < 0)
		return;
	to->vendor = about.idVendor;
	to->product = about.idProduct;
	to->version = about.bcdUSB;
	to->is_vision = is_vision(from);
}

void usb_topology_read(const struct doctor *doctor, struct usb_topology *out)
{
	libusb_context *context = NULL;
	libusb_device **list = NULL;
	int err = libusb_init(&context);
	ssize_t count = err ? err : libusb_get_device_list(context, &list);

	memset(out, 0, sizeof(*out));
	if (count < 0)
		snprintf(out->error, sizeof(out->error), "%s", libusb_strerror((int)count));
	for (ssize_t i = 0; i < count && out->count < USB_DEVICE_MAX; i++)
		read_device(doctor, list[i], &out->devices[out->count++]);
	if (list)
		libusb_free_device_list(list, 1);
	if (!err)
		libusb_exit(context);
}
