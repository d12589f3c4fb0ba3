/*
 * Where scene files are: beside the source when a program runs from its build directory, else
 * where they were installed.
 */
#pragma once

#include <limits.h>
#include <stddef.h>

#include "base/diag.h"
#include "track/layout.h"

#define SCENE_NAMES_MAX 256

/* `scene` is a name ("talking") or, with a / in it or .yaml at its end, the path of a file. Returns
 * 0, -EINVAL when there is no scene of that name, or -ENAMETOOLONG, with a message. */
int scene_find(char path[PATH_MAX], const char *scene, struct diag *diag);

/* The names of all scenes, sorted. Returns 0 or a negative errno with a message. */
int scene_names(char names[SCENE_NAMES_MAX][NAME_BYTES], size_t *count, struct diag *diag);
