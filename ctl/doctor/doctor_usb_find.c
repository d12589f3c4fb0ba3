/*
 * From addresses of the config to USB devices.
 */
#include <arpa/inet.h>
#include <stdlib.h>
#include <string.h>

#include "ctl/doctor/doctor_tree.h"
#include "ctl/doctor/doctor_usb.h"
#include "drivers/usb/trigger_usb.h"

#define FT232H_VENDOR 0x0403
#define FT232H_PRODUCT 0x6014

bool usb_is_below(const char *below, const char *above)
{
	size_t length = strlen(above);

	if (strcmp(below, above) == 0)
		return true;
	if (strncmp(above, "usb", 3) == 0)
		return strncmp(below, above + 3, length - 3) == 0 && below[length - 3] == '-';
	return strncmp(below, above, length) == 0 && below[length] == '.';
}

static uint32_t by_name(const struct usb_topology *usb, const char *name)
{
	for (uint32_t d = 0; d < usb->count; d++)
		if (strcmp(usb->devices[d].name, name) == 0)
			return d;
	return USB_NONE;
}

/* What a camera's node hangs on: "1-2.3:1.0" is interface 0 of the device 1-2.3. */
static uint32_t by_video(const struct doctor *doctor, const char *video)
{
	char path[TREE_PATH_BYTES], *whole, *name, *colon;
	uint32_t found = USB_NONE;

	tree_path(doctor, path, "/sys/class/video4linux/%s/device", video);
	whole = realpath(path, NULL);
	if (!whole)
		return USB_NONE;
	name = strrchr(whole, '/');
	colon = name ? strchr(name, ':') : NULL;
	if (colon) {
		*colon = '\0';
		found = by_name(doctor->facts.usb, name + 1);
	}
	free(whole);
	return found;
}

/* /dev/video0, or a link to it as in /dev/v4l/by-path. */
static uint32_t by_node(const struct doctor *doctor, const char *node)
{
	char path[TREE_PATH_BYTES];
	uint32_t found = USB_NONE;

	tree_path(doctor, path, "%s", node);
	char *whole = realpath(path, NULL);

	if (whole)
		found = by_video(doctor, strrchr(whole, '/') + 1);
	free(whole);
	return found;
}

static uint32_t by_card(const struct doctor *doctor, const char *card)
{
	char name[64];
	uint32_t found = USB_NONE;
	glob_t nodes;

	tree_glob(doctor, "/sys/class/video4linux/video[0-9]*/name", &nodes);
	for (size_t i = 0; i < nodes.gl_pathc && found == USB_NONE; i++) {
		char *path = nodes.gl_pathv[i];

		tree_line(doctor, name, sizeof(name), "%s", tree_name(doctor, path));
		if (strncmp(name, card, strlen(card)) != 0)
			continue;
		*strrchr(path, '/') = '\0';
		found = by_video(doctor, strrchr(path, '/') + 1);
	}
	globfree(&nodes);
	return found;
}

static uint32_t by_serial(const struct usb_topology *usb, const char *serial, size_t length)
{
	for (uint32_t d = 0; d < usb->count; d++)
		if (length && strncmp(usb->devices[d].serial, serial, length) == 0 &&
		    !usb->devices[d].serial[length])
			return d;
	return USB_NONE;
}

static uint32_t by_v4l2(const struct doctor *doctor, const char *rest)
{
	if (strncmp(rest, "serial=", 7) == 0)
		return by_serial(doctor->facts.usb, rest + 7, strcspn(rest + 7, ","));
	if (strncmp(rest, "card=", 5) == 0)
		return by_card(doctor, rest + 5);
	return by_node(doctor, rest);
}

/* Aravis' id of a USB3 Vision camera holds its serial number. */
static uint32_t by_vision(const struct usb_topology *usb, const char *rest)
{
	for (uint32_t d = 0; d < usb->count; d++)
		if (usb->devices[d].is_vision && *usb->devices[d].serial &&
		    strstr(rest, usb->devices[d].serial))
			return d;
	return USB_NONE;
}

bool usb_may_be_camera(const char *address)
{
	struct in_addr ip;

	return strncmp(address, "v4l2:", 5) == 0 ||
	       (strncmp(address, "aravis:", 7) == 0 && inet_pton(AF_INET, address + 7, &ip) != 1);
}

uint32_t usb_of_camera(const struct doctor *doctor, uint32_t c)
{
	const char *address = doctor->config->cameras[c].address;

	if (!usb_may_be_camera(address))
		return USB_NONE;
	return strncmp(address, "v4l2:", 5) == 0 ? by_v4l2(doctor, address + 5)
						 : by_vision(doctor->facts.usb, address + 7);
}

uint32_t usb_of_trigger(const struct doctor *doctor, const char *rest)
{
	const struct usb_topology *usb = doctor->facts.usb;
	struct usb_address address;

	if (usb_address_parse(&address, rest, "trigger", NULL))
		return USB_NONE;
	if (*address.adapter)
		return by_serial(usb, address.adapter, strlen(address.adapter));
	for (uint32_t d = 0; d < usb->count; d++)
		if (usb->devices[d].vendor == FT232H_VENDOR &&
		    usb->devices[d].product == FT232H_PRODUCT)
			return d;
	return USB_NONE;
}
