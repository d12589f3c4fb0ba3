/*
 * The text of rig.yaml. Only calib/ includes this.
 */
#pragma once

#include <stdio.h>

#include "calib/rig/rig_write.h"

void rig_facts_print(FILE *file, const struct rig_facts *facts, const char *revision);
