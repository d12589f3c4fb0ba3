/*
 * A recording through the tracking of the live station: nothing dropped, one marker set per shot.
 * The same files give the same sets.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "config/stage.h"
#include "track/observe.h"

struct replay;

struct replay_count {
	uint64_t shots, incomplete, stale;
};

/* Opens what the config names; `layout_path`, when not NULL, is used instead of its layouts.
 * Returns an exit code, with messages. */
int replay_open(struct replay **out, const char *config_path, const char *layout_path,
		uint64_t threads, struct diag *diag);
void replay_close(struct replay *replay); /* accepts NULL */

const struct stage *replay_stage(const struct replay *replay);
struct replay_count replay_count(const struct replay *replay);

/* The shot that replay_next() was made of; valid as long as that. */
const struct shot *replay_shot(const struct replay *replay);

/* The next shot, or NULL at the end; valid until the next call. */
const struct marker_set *replay_next(struct replay *replay);

/* After the end: what the cameras lost. Damage goes into `diag`. */
void replay_report(const struct replay *replay, struct diag *diag);
