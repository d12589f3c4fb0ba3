/*
 * Reads a layout: YAML (so JSON too),
 *   markers: [{name, neutral_m: [x, y, z], group, rigid: true|false, diameter_m}]
 * in head coordinates, and optionally `actor: NAME`.
 */
#pragma once

#include "base/diag.h"
#include "track/layout.h"

/* Messages as in config_load. Returns 0, -EINVAL, or the errno of reading it. */
int layout_load(struct layout *layout, const char *path, struct diag *diag);
