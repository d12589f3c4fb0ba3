/*
 * One camera of the configuration file.
 */
#pragma once

#include "config/config.h"
#include "config/yaml.h"

/* Reads it and adds it to config->cameras, where there is room for it. */
void camera_read(struct yaml *yaml, const struct yaml_value *value, struct config *config);
