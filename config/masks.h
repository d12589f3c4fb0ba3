/*
 * A file of masks, a list of cameras with their areas: written by stagectl, read with the config
 * that names it.
 */
#pragma once

#include <stdint.h>
#include <stdio.h>

#include "base/diag.h"
#include "drivers/camera.h"
#include "track/blobs/mask.h"
#include "track/layout.h"

struct yaml;
struct yaml_value;

struct named_mask {
	char camera[NAME_BYTES];
	struct mask mask;
};

struct masks {
	uint32_t count;
	struct named_mask cameras[CAMERA_MAX];
};

/* A file that is not there holds no masks. Returns 0, -EINVAL, or the errno of reading it. */
int masks_load(struct masks *masks, const char *path, struct diag *diag);

/* As masks_load() reads it. */
void masks_write(const struct masks *masks, FILE *file);

/* Returns 0 or -ENOSPC. */
int masks_set(struct masks *masks, const char *camera, const struct mask *mask);

/* Reads a list of areas. */
void mask_read(struct yaml *yaml, const struct yaml_value *value, struct mask *mask);
