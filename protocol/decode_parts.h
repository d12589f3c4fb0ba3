/*
 * What the decoders of the several messages share. For protocol/decode*.c only.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "protocol/stage_client.h"
#include "stage.pb-c.h"

/* Room in the arena `user` of the message being decoded; NULL when that is full. */
void *decode_alloc(void *user, size_t size);

/* Texts end up on terminals and in logs: control characters have no place there. */
bool decode_text_is_clean(const char *text);

/* Returns 0 or -EPROTO. */
int decode_statistics(void *arena, const Stage__V1__Statistics *from, struct stage_event *event);
