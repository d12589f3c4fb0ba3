/*
 * What the station has answered: its parameters, or what its error means to who asked.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

/* *out (the caller's) is the parameters of the reply in `text`. What is no printable text in them
 * is there as \\u001b, so that nothing of the other side's reaches a terminal as it is. Returns 0,
 * or an exit code with a message on stderr. */
int control_reply_unpack(json_t **out, bool *continues, const char *text);

/* The text behind `key`, borrowed; NULL with a message when there is none: then what answers is no
 * station. */
const char *control_reply_text(const json_t *reply, const char *key);
