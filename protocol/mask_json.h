/*
 * A camera's mask as the control socket's messages bear it: a list of areas, each {x, y, width,
 * height} in pixels.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

#include "track/blobs/mask.h"

json_t *mask_to_json(const struct mask *mask); /* the caller's */

/* False, and *out untouched, when it is no such list, or has more areas than a mask holds. */
bool mask_from_json(struct mask *out, const json_t *areas);
