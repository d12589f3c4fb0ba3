/*
 * An FT232H adapter whose eight lines D0 to D7 follow the bytes that it is sent, one sample a byte,
 * by its own clock (asynchronous bit-bang). Returns are 0 or a negative errno; -ENODEV: it is gone.
 * Control thread, but for submit, cancel and handle, which belong to one thread at a time.
 */
#pragma once

#include <stdint.h>

#include "base/diag.h"

#define FT232H_NAME_BYTES 64
/* High while the adapter is a serial port, which it is from plugging in until it is opened. */
#define FT232H_SERIAL_OUTPUTS 0x15 /* D0 (TXD), D2 (RTS), D4 (DTR) */

struct ft232h;

/* Bytes on their way. */
struct ft232h_write {
	uint8_t *bytes; /* owned */
	uint32_t length;
	/* the adapter took all of them, or the errno why not (-ECANCELED); from ft232h_handle() */
	void (*taken)(struct ft232h_write *write, int err);
	void *user;
	int64_t mark; /* the user's */
	/* the adapter's */
	struct ft232h *adapter;
	void *transfer;
};

/* An adapter that is plugged in. */
struct ft232h_info {
	char port[FT232H_NAME_BYTES];   /* as the kernel names it: 1-2.4 */
	char serial[FT232H_NAME_BYTES]; /* "": it has none, or it cannot be asked */
	int error;                      /* why it cannot be opened, or 0 */
};

/* Messages begin with `who`. */
int ft232h_list(void (*found)(const struct ft232h_info *info, void *user), void *user,
		const char *who, struct diag *diag);

/* `wanted` is a serial number, a port ("1-2.4"), or "" for the only one there is. Messages begin
 * with `who`. -ENODEV: none such; -EACCES; -EBUSY: another program has it. */
int ft232h_open(struct ft232h **out, const char *wanted, const char *who, struct diag *diag);
void ft232h_close(struct ft232h *adapter); /* accepts NULL; outputs stay low */

/* Of the largest packet. */
uint32_t ft232h_packet_bytes(const struct ft232h *adapter);

/* Only while nothing is on its way. The lines of `mask` become outputs, low from the start. A
 * sample lasts `divisor` / 60 us. */
int ft232h_set_outputs(struct ft232h *adapter, uint8_t mask);
int ft232h_set_divisor(struct ft232h *adapter, uint32_t divisor);

int ft232h_write_init(struct ft232h *adapter, struct ft232h_write *write, uint32_t capacity);
void ft232h_write_finish(struct ft232h_write *write); /* a zeroed one is fine */

/* Writes are taken in their order. A length that is no multiple of the packet ends in a short one.
 */
int ft232h_submit(struct ft232h_write *write);
void ft232h_cancel(struct ft232h_write *write);

/* Waits at most `timeout_ns` for something to be taken and tells. */
int ft232h_handle(struct ft232h *adapter, int64_t timeout_ns);
