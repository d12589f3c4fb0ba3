/*
 * One shot's truth as a line of JSON.
 */
#pragma once

#include <stdio.h>

#include "sim/world/scene.h"

/* Returns 0, -ENOMEM, or -EIO with errno set by the failing write. */
int truth_json_write(const struct sim_scene *scene, uint64_t shot, const struct sim_truth *truth,
		     FILE *file);
