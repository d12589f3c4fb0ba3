/*
 * The GenICam description of a simulated GigE Vision camera.
 */
#pragma once

#include <stdbool.h>

#define GIGE_REGISTER_PTP_ENABLE 0x3f0

/* With `ptp` it follows PTP when it is told to. Fixed size, rate and exposure: what the scene shows
 * cannot be asked otherwise. Returns the XML, to be freed, or NULL without memory. */
char *gige_genicam_xml(double rate_hz, double exposure_us, bool ptp);
