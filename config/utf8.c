/*
 * Checks UTF-8 before a library sees it: libfyaml 0.7 does not come back from some broken text.
 */
#include "config/utf8.h"

#include <stdint.h>

/* Bytes of the character at `s`, of which `left` are there, or 0 when it is none. */
static size_t character_bytes(const unsigned char *s, size_t left)
{
	static const uint32_t least[5] = {0, 0, 0x80, 0x800, 0x10000};
	size_t count = s[0] < 0x80             ? 1
		       : (s[0] & 0xe0) == 0xc0 ? 2
		       : (s[0] & 0xf0) == 0xe0 ? 3
		       : (s[0] & 0xf8) == 0xf0 ? 4
					       : 0;
	uint32_t code;

	if (count <= 1)
		return count;
	if (count > left)
		return 0;
	code = s[0] & (0x7fu >> count);
	for (size_t i = 1; i < count; i++) {
		if ((s[i] & 0xc0) != 0x80)
			return 0;
		code = code << 6 | (s[i] & 0x3f);
	}
	if (code < least[count] || code > 0x10ffff || (code >= 0xd800 && code <= 0xdfff))
		return 0;
	return count;
}

size_t utf8_valid_bytes(const char *text, size_t size)
{
	size_t at = 0;

	while (at < size) {
		size_t count = character_bytes((const unsigned char *)text + at, size - at);

		if (!count)
			break;
		at += count;
	}
	return at;
}
