/*
 * Checks the text of a mrcal .cameramodel before libmrcal reads it, so that a message names the
 * field that is wrong. The text is a Python dictionary of strings, numbers and nested lists.
 */
#pragma once

#include <stddef.h>

#include "base/diag.h"

/* `text` has a NUL at text[size]. `path` is for the messages. Returns 0 or -EINVAL. */
int model_text_check(const char *text, size_t size, const char *path, struct diag *diag);
