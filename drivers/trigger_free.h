/*
 * Trigger `free`: there is none. The cameras run by their own clocks, or are recordings; shots are
 * made from the frames' own times.
 */
#pragma once

#include "drivers/trigger.h"

extern const struct trigger_driver free_trigger_driver;
