/*
 * What the files of the report share. Nobody else includes this.
 */
#pragma once

#include <stdio.h>

#include "calib/report/report.h"

/* report_images.c: per camera, where corners were and what is left of them. */
void report_images_print(FILE *file, const struct report_facts *facts);

/* report_space.c: cameras, board and uncertainty from above, from the front and from the side. */
void report_space_print(FILE *file, const struct report_facts *facts);
