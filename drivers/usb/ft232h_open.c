/*
 * Finds the adapter that is meant among all that is plugged in, takes it from the kernel's
 * serial driver, and says what is wrong when it cannot be had.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/usb/ft232h_device.h"

#define VENDOR 0x0403
#define PRODUCT 0x6014
#define RELEASE 0x0900
#define INTERFACE 0
#define PORTS_MAX 7
#define LISTED_BYTES 256

/* What a look at all devices found. */
struct search {
	const char *wanted;
	libusb_device_handle *handle; /* open, of the one that is meant */
	int adapters, matches;
	char listed[LISTED_BYTES];      /* names of all adapters */
	char closed[FT232H_NAME_BYTES]; /* one that may not be opened, "" none */
	int closed_error;
	char others[LISTED_BYTES]; /* FTDI devices of other kinds */
};

static void append(char *list, const char *name)
{
	size_t used = strlen(list);

	snprintf(list + used, LISTED_BYTES - used, "%s%s", used ? ", " : "", name);
}

/* As the kernel names it: 1-2.4 */
static void port_name(libusb_device *device, char *name)
{
	uint8_t ports[PORTS_MAX];
	int count = libusb_get_port_numbers(device, ports, PORTS_MAX);
	int used = snprintf(name, FT232H_NAME_BYTES, "%d", libusb_get_bus_number(device));

	for (int i = 0; i < count; i++)
		used += snprintf(name + used, (size_t)(FT232H_NAME_BYTES - used), "%c%d",
				 i ? '.' : '-', ports[i]);
}

static void note_other(struct search *search, libusb_device *device, uint16_t product)
{
	char port[FT232H_NAME_BYTES], text[2 * FT232H_NAME_BYTES];
	const char *kind = product == 0x6001   ? "FT232R"
			   : product == 0x6010 ? "FT2232"
			   : product == 0x6011 ? "FT4232"
			   : product == 0x6015 ? "FT-X"
					       : "FTDI device";

	port_name(device, port);
	snprintf(text, sizeof(text), "%s (0403:%04x) at %s", kind, product, port);
	append(search->others, text);
}

static void look_at_adapter(struct search *search, libusb_device *device,
			    const struct libusb_device_descriptor *about)
{
	char port[FT232H_NAME_BYTES], serial[FT232H_NAME_BYTES] = "";
	libusb_device_handle *handle = NULL;

	search->adapters++;
	port_name(device, port);
	int err = libusb_open(device, &handle);

	if (!err && about->iSerialNumber &&
	    libusb_get_string_descriptor_ascii(handle, about->iSerialNumber,
					       (unsigned char *)serial, sizeof(serial)) < 0)
		serial[0] = 0;
	if (err) {
		snprintf(search->closed, sizeof(search->closed), "%s", port);
		search->closed_error = ft232h_errno(err);
	}
	append(search->listed, serial[0] ? serial : port);
	bool meant = !search->wanted[0] || strcmp(search->wanted, port) == 0 ||
		     (serial[0] && strcmp(search->wanted, serial) == 0);

	search->matches += meant;
	if (handle && meant && !search->handle)
		search->handle = handle;
	else if (handle)
		libusb_close(handle);
}

static int look_around(libusb_context *context, struct search *search)
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
			look_at_adapter(search, devices[i], &about);
		else
			note_other(search, devices[i], about.idProduct);
	}
	libusb_free_device_list(devices, 1);
	return 0;
}

/* Why it is not there, in the order of what helps most. */
static int explain(const struct search *search, const char *who, struct diag *diag)
{
	if (search->matches > 1) {
		diag_add(diag, "%s: there are %d adapters; choose one: usb:SERIAL with one of %s",
			 who, search->matches, search->listed);
		return -EINVAL;
	}
	if (search->closed[0] && !search->handle) {
		diag_add(diag,
			 "%s: cannot open the adapter at %s: %s; join the group stage-operator and "
			 "install 70-stage.rules",
			 who, search->closed, strerror(-search->closed_error));
		return search->closed_error;
	}
	if (search->adapters && !search->handle) {
		diag_add(diag, "%s: no such adapter; there are %s", who, search->listed);
		return -ENODEV;
	}
	if (!search->handle && search->others[0])
		diag_add(diag,
			 "%s: no FT232H; there is %s, whose clock cannot time pulses; plug in an "
			 "FT232H",
			 who, search->others);
	else if (!search->handle)
		diag_add(diag, "%s: no FT232H adapter on USB; plug one in", who);
	return search->handle ? 0 : -ENODEV;
}

/* Once it is let go, the serial driver does not get it back: whatever a program writes to a serial
 * port would be on the lines. Plugging it in again makes it one. */
static int take(struct ft232h *adapter, const char *who, struct diag *diag)
{
	int err = 0;

	if (libusb_kernel_driver_active(adapter->handle, INTERFACE) == 1)
		err = libusb_detach_kernel_driver(adapter->handle, INTERFACE);
	if (err) {
		diag_add(
			diag,
			"%s: the kernel's driver (ftdi_sio) does not let go of it: %s; unload that "
			"with rmmod ftdi_sio",
			who, libusb_error_name(err));
		return ft232h_errno(err);
	}
	err = libusb_claim_interface(adapter->handle, INTERFACE);
	if (err)
		diag_add(diag, "%s: another program uses it: %s; end that", who,
			 libusb_error_name(err));
	return ft232h_errno(err);
}

static int find_endpoint(struct ft232h *adapter, const char *who, struct diag *diag)
{
	struct libusb_config_descriptor *config;
	int err = libusb_get_active_config_descriptor(libusb_get_device(adapter->handle), &config);

	if (!err && config->bNumInterfaces > INTERFACE) {
		const struct libusb_interface_descriptor *interface =
			&config->interface[INTERFACE].altsetting[0];

		for (int e = 0; e < interface->bNumEndpoints; e++) {
			const struct libusb_endpoint_descriptor *end = &interface->endpoint[e];

			if ((end->bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) ==
				    LIBUSB_TRANSFER_TYPE_BULK &&
			    !(end->bEndpointAddress & LIBUSB_ENDPOINT_IN)) {
				adapter->endpoint = end->bEndpointAddress;
				adapter->packet_bytes = end->wMaxPacketSize & 0x7ff;
			}
		}
	}
	if (!err)
		libusb_free_config_descriptor(config);
	if (adapter->packet_bytes)
		return 0;
	diag_add(diag, "%s: it has no endpoint for bytes: not an FT232H; plug in one", who);
	return -ENODEV;
}

void ft232h_close(struct ft232h *adapter)
{
	if (!adapter)
		return;
	if (adapter->handle) {
		libusb_release_interface(adapter->handle, INTERFACE);
		libusb_close(adapter->handle);
	}
	if (adapter->context)
		libusb_exit(adapter->context);
	free(adapter);
}

int ft232h_open(struct ft232h **out, const char *wanted, const char *who, struct diag *diag)
{
	struct search search = {.wanted = wanted};
	struct ft232h *adapter = calloc(1, sizeof(*adapter));
	int err = adapter ? libusb_init(&adapter->context) : LIBUSB_ERROR_NO_MEM;

	if (!err)
		err = look_around(adapter->context, &search);
	if (err) {
		err = ft232h_errno(err);
		diag_add(diag, "%s: no USB on this machine: %s", who, strerror(-err));
		goto fail;
	}
	adapter->handle = search.handle;
	err = explain(&search, who, diag);
	if (!err)
		err = take(adapter, who, diag);
	if (!err)
		err = find_endpoint(adapter, who, diag);
	if (err)
		goto fail;
	*out = adapter;
	return 0;
fail:
	ft232h_close(adapter);
	return err;
}
