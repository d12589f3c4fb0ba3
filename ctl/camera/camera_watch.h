/*
 * Cameras that come and go.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* Prints what is there, then every arrival and departure, for `seconds` (0: until SIGINT or
 * SIGTERM). Returns an exit code. */
int camera_watch(bool json, uint64_t seconds);
