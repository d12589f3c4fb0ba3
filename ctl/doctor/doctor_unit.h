/*
 * What the installed unit staged.service says.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ctl/doctor/doctor.h"

/* The value of a directive, the last one of those in the unit and its drop-ins; false when no unit
 * is installed, or it says nothing of it. */
bool unit_read(const struct doctor *doctor, const char *directive, char *value, size_t size);

bool unit_installed(const struct doctor *doctor);

/* A resource limit's; UINT64_MAX for infinity. */
uint64_t unit_amount(const char *value);
