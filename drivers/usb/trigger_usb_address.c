/*
 * Reads the address of a USB trigger.
 */
#include <errno.h>
#include <string.h>

#include "drivers/usb/trigger_usb.h"

#define FORM "usb:SERIAL,ir=D5,strobe=D6,hd=D7"
#define PART_BYTES FT232H_NAME_BYTES

static const char *const keys[PULSE_LINE_COUNT] = {
	[PULSE_IR] = "ir", [PULSE_STROBE] = "strobe", [PULSE_HD] = "hd"};
static const uint8_t usual_bits[PULSE_LINE_COUNT] = {
	[PULSE_IR] = 1 << 5, [PULSE_STROBE] = 1 << 6, [PULSE_HD] = 1 << 7};

/* A strobe must be dark while nobody has the adapter. */
static int check_line(enum pulse_line line, uint8_t bit, const char *name, const char *who,
		      struct diag *diag)
{
	if (line != PULSE_STROBE || !(bit & FT232H_SERIAL_OUTPUTS))
		return 0;
	diag_add(diag,
		 "%s: strobe=%s: this line is high from plugging in until the station has the "
		 "adapter; take D1, D3, D5, D6 or D7",
		 who, name);
	return -EINVAL;
}

static int set_line(struct usb_address *address, const char *key, const char *name, const char *who,
		    struct diag *diag)
{
	int line = 0;

	while (line < PULSE_LINE_COUNT && strcmp(keys[line], key) != 0)
		line++;
	if (line == PULSE_LINE_COUNT) {
		diag_add(diag, "%s: '%s' is none of ir, strobe and hd", who, key);
		return -EINVAL;
	}
	if (name[0] != 'D' || name[1] < '0' || name[1] > '7' || name[2]) {
		diag_add(diag, "%s: %s=%s: no such line; an adapter has D0 to D7", who, key, name);
		return -EINVAL;
	}
	uint8_t bit = (uint8_t)(1 << (name[1] - '0'));

	for (int l = 0; l < PULSE_LINE_COUNT; l++)
		if (l == line ? address->bits[l] : address->bits[l] == bit) {
			diag_add(diag,
				 "%s: %s=%s: given twice, the line or what it is for; give each "
				 "once",
				 who, key, name);
			return -EINVAL;
		}
	address->bits[line] = bit;
	return check_line((enum pulse_line)line, bit, name, who, diag);
}

static int read_part(struct usb_address *address, char *part, bool first, const char *who,
		     struct diag *diag)
{
	char *equals = strchr(part, '=');

	if (first && !equals) {
		snprintf(address->adapter, sizeof(address->adapter), "%s", part);
		return 0;
	}
	if (!equals) {
		diag_add(diag, "%s: '%s' does not name a line; write " FORM, who, part);
		return -EINVAL;
	}
	*equals = 0;
	return set_line(address, part, equals + 1, who, diag);
}

int usb_address_parse(struct usb_address *out, const char *rest, const char *who, struct diag *diag)
{
	struct usb_address address = {0};
	char part[PART_BYTES];

	for (bool first = true; *rest; first = false) {
		size_t length = strcspn(rest, ",");

		if (length >= sizeof(part)) {
			diag_add(diag, "%s: an endless name; write " FORM, who);
			return -EINVAL;
		}
		memcpy(part, rest, length);
		part[length] = 0;
		rest += length + (rest[length] == ',');
		int err = read_part(&address, part, first, who, diag);
		if (err)
			return err;
	}
	if (!address.bits[PULSE_IR] && !address.bits[PULSE_STROBE] && !address.bits[PULSE_HD])
		memcpy(address.bits, usual_bits, sizeof(address.bits));
	*out = address;
	return 0;
}

uint32_t usb_address_fires(const char *rest)
{
	struct usb_address address;

	if (usb_address_parse(&address, rest, "", NULL))
		return 0;
	return (address.bits[PULSE_IR] ? TRIGGER_FIRES_IR : 0) |
	       (address.bits[PULSE_STROBE] ? TRIGGER_FIRES_STROBE : 0) |
	       (address.bits[PULSE_HD] ? TRIGGER_FIRES_HD : 0);
}
