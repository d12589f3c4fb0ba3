/*
 * What the encoders of the several messages share. For protocol/encode*.c only.
 */
#pragma once

#include "protocol/encode.h"
#include "stage.pb-c.h"

/* Packs a message behind its length, on the heap. Returns 0 or -ENOMEM. */
int encode_frame(const Stage__V1__Message *message, uint8_t **frame, size_t *size_bytes);

/* protobuf-c has no const strings; packing only reads them. */
static inline char *encode_text(const char *s)
{
	return (char *)(uintptr_t)s;
}
