/*
 * Does the rig fit the recording? Watches the residuals of a take, and which camera looks elsewhere
 * than its calibration says.
 */
#pragma once

#include <jansson.h>
#include <stdio.h>

#include "config/stage.h"
#include "track/observe.h"

struct rig_fit;

struct rig_fit *rig_fit_create(const struct stage *stage); /* borrowed; NULL: out of memory */
void rig_fit_destroy(struct rig_fit *fit);                 /* accepts NULL */
void rig_fit_step(struct rig_fit *fit, const struct shot *shot, const struct marker_set *set);

/* What is bad, one line each, with the remedy; nothing when the rig fits. */
void rig_fit_print(const struct rig_fit *fit, FILE *out);

/* {"residual_px": rms, null without a measured marker, "moved": [{"camera", "shift_px",
 * "turn_mrad"}], "cameras": [{"camera", "residual_px", "residual_sigmas"}]}; a new reference. */
json_t *rig_fit_json(const struct rig_fit *fit);
