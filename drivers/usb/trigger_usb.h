/*
 * Trigger `usb`: pulses on the lines of an FT232H adapter, timed by the adapter's own clock. Its
 * address is
 *
 *     usb:SERIAL,ir=LINE,strobe=LINE,hd=LINE
 *
 * with lines D0 to D7. Without a serial number it is the only adapter there is; without lines they
 * are ir=D5, strobe=D6 and hd=D7.
 */
#pragma once

#include "drivers/gpio/pulse_train.h"
#include "drivers/usb/ft232h.h"

struct usb_address {
	char adapter[FT232H_NAME_BYTES];
	uint8_t bits[PULSE_LINE_COUNT]; /* of the bytes, by enum pulse_line; 0: not wired */
};

/* Returns 0 or -EINVAL with a message that begins with `who`. */
int usb_address_parse(struct usb_address *out, const char *rest, const char *who,
		      struct diag *diag);

/* trigger_driver.fires() */
uint32_t usb_address_fires(const char *rest);

extern const struct trigger_driver usb_trigger_driver;
