/*
 * What was captured of an actor, on disk as soon as it is: one line of JSON a part, the last line
 * of a name counts. An interrupted capture goes on from it.
 */
#pragma once

#include <limits.h>
#include <stdio.h>

#include "base/diag.h"
#include "calib/actor/actor.h"
#include "calib/actor/actor_script.h"

enum actor_outcome {
	OUTCOME_OPEN, /* not yet asked for */
	OUTCOME_CAPTURED,
	OUTCOME_SKIPPED,  /* by the operator */
	OUTCOME_NOT_SEEN, /* the face did not move in time */
};

struct actor_capture {
	struct actor_part neutral; /* empty: not yet */
	struct actor_part poses[ACTOR_POSE_COUNT];
	int outcomes[ACTOR_POSE_COUNT]; /* enum actor_outcome */
};

struct actor_journal {
	FILE *file;
	char path[PATH_MAX];
};

const char *actor_outcome_name(int outcome);

/* Opens `path`; what it holds of an earlier capture of these markers comes into `capture`, unless
 * `fresh`. Returns an exit code, with messages. */
int actor_journal_open(struct actor_journal *journal, struct actor_capture *capture,
		       const char *path, const struct layout *layout, bool fresh,
		       struct diag *diag);
void actor_journal_close(struct actor_journal *journal); /* a zeroed one is fine */

/* The part of a pose, or of "neutral", is on the disk when this returns. 0 or a negative errno. */
int actor_journal_add(struct actor_journal *journal, const char *name, int outcome,
		      const struct actor_part *part);

void actor_capture_finish(struct actor_capture *capture); /* a zeroed one is fine */
