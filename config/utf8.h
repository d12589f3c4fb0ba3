/*
 * Whether a text is UTF-8 (RFC 3629: no overlong forms, no surrogates, up to U+10FFFF).
 */
#pragma once

#include <stddef.h>

/* How many bytes from the start are whole, valid characters: `size` when all are. */
size_t utf8_valid_bytes(const char *text, size_t size);
