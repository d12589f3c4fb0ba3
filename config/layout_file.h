/*
 * Reads a layout: YAML (so JSON too),
 *   markers: [{name, neutral_m: [x, y, z], group, rigid: true|false, diameter_m,
 *             segment, mpeg4, learned}]
 * in head coordinates, and optionally `actor: NAME`. The file of a calibrated actor is one with
 * `learned`.
 */
#pragma once

#include "base/diag.h"
#include "track/layout.h"

/* Messages as in config_load. Returns 0, -EINVAL, or the errno of reading it. */
int layout_load(struct layout *layout, const char *path, struct diag *diag);

/* Puts one actor's layout, read from `path`, behind those of the others. Returns 0, or -EINVAL with
 * a message. */
int layout_join(struct layout *all, const struct layout *one, const char *path, struct diag *diag);
