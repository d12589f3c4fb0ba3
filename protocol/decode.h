/*
 * From the bytes of one message to the plain structs of stage_client.h. The bytes are untrusted:
 * whatever they are, decoding stays within a fixed arena and every index it hands out is in range.
 */
#pragma once

#include <stddef.h>

#include "protocol/stage_client.h"

#define MESSAGE_BYTES_MAX (16u << 20)

struct decoder;
int decoder_create(struct decoder **out);      /* 0 or -ENOMEM */
void decoder_destroy(struct decoder *decoder); /* accepts NULL */

/* Returns 0 or -EPROTO: malformed, out of range, a marker set before any description, or too rich
 * for the arena. What `event` points to is the decoder's, as stage_client.h says. */
int decode_message(struct decoder *decoder, const uint8_t *bytes, size_t size_bytes,
		   struct stage_event *event);
