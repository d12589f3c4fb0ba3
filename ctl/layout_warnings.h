/*
 * What is allowed in a layout and hardly meant.
 */
#pragma once

#include <jansson.h>

#include "config/stage.h"

/* An array of texts, one for each thing, with the layout's path; a new reference. */
json_t *layout_warnings(const struct stage *stage);
