/*
 * Asks a program's drivers about the addresses in its config.
 */
#pragma once

#include "config/config.h"
#include "config/yaml.h"

void addresses_ask(struct yaml *yaml, const struct config *config,
		   const struct config_drivers *drivers, struct yaml_place trigger);
