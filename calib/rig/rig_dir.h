/*
 * A directory that becomes a rig's revision: whole or not at all.
 */
#pragma once

#include <limits.h>
#include <stdint.h>
#include <stdio.h>

#include "base/diag.h"
#include "track/layout.h"

#define RIG_MODEL_SUFFIX ".cameramodel"
#define RIG_FILE_BYTES (PATH_MAX + NAME_MAX + 2) /* of the path of a file in a directory */

/* A message; returns -err. */
int rig_dir_fail(const char *path, int err, struct diag *diag);

/* A new file of the directory. NULL with a message. */
FILE *rig_dir_file(const char *dir, const char *name, char path[RIG_FILE_BYTES], struct diag *diag);

/* Closes; all bytes are on the disk when it returns 0. */
int rig_dir_finish_file(FILE *file, const char *path, struct diag *diag);

/* Loads it as the station does; `revision` gets what the station will call it. */
int rig_dir_try(const char *dir, const char (*names)[NAME_BYTES], uint32_t count, char revision[17],
		struct diag *diag);

/* Puts the files into `dir`. Returns 0 or a negative errno with a message. */
typedef int rig_dir_fill_fn(const char *dir, void *user, struct diag *diag);

/* Returns 0, -EEXIST when there is something at `dir`, or a negative errno, each with a message. */
int rig_dir_make(const char *dir, rig_dir_fill_fn *fill, void *user, struct diag *diag);
