/*
 * FTDI's vendor requests, as its application notes AN_232R-01 and AN_120 and the public drivers
 * have them. In bit-bang mode the chip puts out five bytes in the time of one bit of its fast baud
 * rate: 60 MHz over the divisor.
 */
#include "drivers/usb/ft232h.h"

#include <errno.h>
#include <libusb.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/usb/ft232h_device.h"

#define REQUEST_OUT (LIBUSB_REQUEST_TYPE_VENDOR | LIBUSB_RECIPIENT_DEVICE | LIBUSB_ENDPOINT_OUT)
#define REQUEST_RESET 0x00
#define REQUEST_BAUD 0x03
#define REQUEST_MODE 0x0b
#define PURGE_ONE_WAY 1
#define PURGE_THE_OTHER 2
#define MODE_BIT_BANG 0x0100
#define FAST_CLOCK 0x0200 /* in the index: bit 17 of the divisor */
#define PORT 1
#define TIMEOUT_MS 1000
#define ZEROS 64

int ft232h_errno(int libusb_error)
{
	switch (libusb_error) {
	case LIBUSB_SUCCESS:
		return 0;
	case LIBUSB_ERROR_ACCESS:
		return -EACCES;
	case LIBUSB_ERROR_NO_DEVICE:
	case LIBUSB_ERROR_NOT_FOUND:
		return -ENODEV;
	case LIBUSB_ERROR_BUSY:
		return -EBUSY;
	case LIBUSB_ERROR_NO_MEM:
		return -ENOMEM;
	case LIBUSB_ERROR_TIMEOUT:
		return -ETIMEDOUT;
	default:
		return -EIO;
	}
}

static int request(struct ft232h *adapter, uint8_t what, uint16_t value, uint16_t index)
{
	int err = libusb_control_transfer(adapter->handle, REQUEST_OUT, what, value, index, NULL, 0,
					  TIMEOUT_MS);

	return ft232h_errno(err < 0 ? err : 0);
}

uint32_t ft232h_packet_bytes(const struct ft232h *adapter)
{
	return adapter->packet_bytes;
}

int ft232h_set_divisor(struct ft232h *adapter, uint32_t divisor)
{
	return request(adapter, REQUEST_BAUD, (uint16_t)divisor, FAST_CLOCK | PORT);
}

static int send_zeros(struct ft232h *adapter)
{
	uint8_t zeros[ZEROS] = {0};
	int sent = 0;
	int err = libusb_bulk_transfer(adapter->handle, adapter->endpoint, zeros, sizeof(zeros),
				       &sent, TIMEOUT_MS);

	return ft232h_errno(err);
}

/* What it may still hold is thrown away, and the last byte becomes 0, while all lines are inputs.
 */
int ft232h_set_outputs(struct ft232h *adapter, uint8_t mask)
{
	int err = request(adapter, REQUEST_MODE, MODE_BIT_BANG, PORT);

	if (!err)
		err = request(adapter, REQUEST_RESET, PURGE_ONE_WAY, PORT);
	if (!err)
		err = request(adapter, REQUEST_RESET, PURGE_THE_OTHER, PORT);
	if (!err)
		err = ft232h_set_divisor(adapter, 60);
	if (!err)
		err = send_zeros(adapter);
	if (!err)
		clock_sleep_until(clock_now_ns() + NS_PER_MS); /* until they are put out */
	if (!err)
		err = request(adapter, REQUEST_MODE, MODE_BIT_BANG | mask, PORT);
	return err;
}

static int error_of(const struct libusb_transfer *transfer)
{
	switch (transfer->status) {
	case LIBUSB_TRANSFER_COMPLETED:
		return transfer->actual_length == transfer->length ? 0 : -EIO;
	case LIBUSB_TRANSFER_CANCELLED:
		return -ECANCELED;
	case LIBUSB_TRANSFER_NO_DEVICE:
		return -ENODEV;
	default:
		return -EIO;
	}
}

static void LIBUSB_CALL tell(struct libusb_transfer *transfer)
{
	struct ft232h_write *write = transfer->user_data;

	write->taken(write, error_of(transfer));
}

int ft232h_write_init(struct ft232h *adapter, struct ft232h_write *write, uint32_t capacity)
{
	write->adapter = adapter;
	write->bytes = calloc(1, capacity);
	write->transfer = libusb_alloc_transfer(0);
	if (write->bytes && write->transfer)
		return 0;
	ft232h_write_finish(write);
	return -ENOMEM;
}

void ft232h_write_finish(struct ft232h_write *write)
{
	libusb_free_transfer(write->transfer);
	free(write->bytes);
	memset(write, 0, sizeof(*write));
}

int ft232h_submit(struct ft232h_write *write)
{
	struct ft232h *adapter = write->adapter;

	libusb_fill_bulk_transfer(write->transfer, adapter->handle, adapter->endpoint, write->bytes,
				  (int)write->length, tell, write, 0);
	return ft232h_errno(libusb_submit_transfer(write->transfer));
}

void ft232h_cancel(struct ft232h_write *write)
{
	libusb_cancel_transfer(write->transfer);
}

int ft232h_handle(struct ft232h *adapter, int64_t timeout_ns)
{
	struct timeval timeout = {.tv_sec = timeout_ns / NS_PER_S,
				  .tv_usec = timeout_ns % NS_PER_S / NS_PER_US};
	int err = libusb_handle_events_timeout_completed(adapter->context, &timeout, NULL);

	return err == LIBUSB_ERROR_INTERRUPTED ? 0 : ft232h_errno(err);
}
