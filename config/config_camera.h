/*
 * One camera of the configuration file.
 */
#pragma once

#include "config/config.h"
#include "config/yaml.h"

/* Reads it and adds it to config->cameras, where there is room for it. */
void camera_read(struct yaml *yaml, const struct yaml_value *value, struct config *config);

/* When the plan is known: how often it is asked for a picture, and whether its exposure fits. */
void camera_finish(struct yaml *yaml, struct config *config, uint32_t index);

/* The index of the camera of this name, or -ENOENT. */
int camera_find(const struct config_camera *cameras, uint32_t count, const char *name);
