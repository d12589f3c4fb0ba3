/*
 * Chooses the adapter that is meant among all that is plugged in, takes it from the kernel's
 * serial driver, and says what is wrong when it cannot be had.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/usb/ft232h_device.h"

#define INTERFACE 0
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

static void note_other(void *user, const char *name)
{
	struct search *search = user;

	append(search->others, name);
}

static void note_adapter(void *user, const struct ft232h_info *info, libusb_device_handle *handle)
{
	struct search *search = user;

	search->adapters++;
	if (info->error) {
		snprintf(search->closed, sizeof(search->closed), "%s", info->port);
		search->closed_error = info->error;
	}
	append(search->listed, info->serial[0] ? info->serial : info->port);
	bool meant = !search->wanted[0] || strcmp(search->wanted, info->port) == 0 ||
		     (info->serial[0] && strcmp(search->wanted, info->serial) == 0);

	search->matches += meant;
	if (handle && meant && !search->handle)
		search->handle = handle;
	else if (handle)
		libusb_close(handle);
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
	const struct ft232h_look look = {note_adapter, note_other, &search};
	struct ft232h *adapter = calloc(1, sizeof(*adapter));
	int err = adapter ? libusb_init(&adapter->context) : LIBUSB_ERROR_NO_MEM;

	if (!err)
		err = ft232h_look_around(adapter->context, &look);
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
