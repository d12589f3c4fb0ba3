/*
 * A GPIO chip of the kernel's gpio-sim, by its directory /sys/devices/platform/gpio-sim.N: the ends
 * of its lines that are not the program's.
 */
#pragma once

#include <stdbool.h>

/* What is on the wire: 0, 1, or a negative errno. */
int gpio_sim_level(const char *device, unsigned int offset);

/* Drives an input. Returns 0 or a negative errno. */
int gpio_sim_drive(const char *device, unsigned int offset, bool high);
