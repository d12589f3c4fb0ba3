/*
 * Writes the file of an actor: his layout with all that was learned. config/layout_file.h reads it.
 */
#pragma once

#include <stdio.h>

#include "track/layout.h"

/* `calibrated` says when, for people. The caller checks the stream for errors. */
void actor_file_write(FILE *out, const struct layout *layout, const char *calibrated);
