/*
 * Scene files: YAML that says who performs what before which cameras, and what goes wrong.
 * docs/scenes.md lists every key.
 */
#pragma once

#include "base/diag.h"
#include "sim/face/script.h"
#include "sim/world/scene.h"

/* Finds, reads and checks the scene of `options` (NULL or "": talking), with what the options put
 * in the place of its own values. Every error of the file is one message file:line:column. Returns
 * 0, -EINVAL, or the errno of reading it. Control thread. */
int sim_script_load(struct sim_script *out, const struct sim_options *options, struct diag *diag);
