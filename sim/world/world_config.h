/*
 * The world that a config describes.
 */
#pragma once

#include <stdbool.h>

#include "config/config.h"
#include "sim/world/scene.h"

/* Whether it has a simulated camera or trigger. */
bool sim_config_wants_world(const struct config *config);

/* For sim_world_open(), at the pace of `plan`; borrows the config. */
struct sim_options sim_config_options(const struct config *config, const struct trigger_plan *plan);
