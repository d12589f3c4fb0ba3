/*
 * The rig that the solver uses, and how a running station gets another one: a helper thread loads
 * and checks it, the solver takes it between two shots, and only then is the old one freed. All
 * calls on the control thread.
 */
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "base/handover.h"
#include "config/stage.h"

/* Immutable once the solver may see it. */
struct live_rig {
	uint32_t serial; /* of the rigs of this station, from 1; in every marker set */
	struct rig rig;  /* owned; empty for the first, which is the stage's */
	struct tracker_rig tracking;
};

#define RIG_REVISIONS 4 /* kept: more rigs than marker sets can be under way with */

struct rig_swap {
	struct handover handover; /* of const struct live_rig, control thread to solver */
	struct live_rig *current; /* owned: offered last */
	struct live_rig *before;  /* owned: until the solver has taken the current one */
	char revisions[RIG_REVISIONS][sizeof(((struct rig *)0)->revision)];

	const struct stage *stage; /* borrowed */
	int wake_fd;               /* borrowed; written when there is something to poll */
	bool loading;
	pthread_t thread;

	/* helper thread; the control thread after `done` */
	struct live_rig *loaded;
	struct diag diag;
	int error;
	_Atomic bool done;
};

enum rig_swap_state {
	RIG_SWAP_NONE,    /* nothing is under way */
	RIG_SWAP_PENDING, /* it loads, or waits for the solver's next shot */
	RIG_SWAP_DONE,    /* once: the solver uses the new rig, the old one is gone */
	RIG_SWAP_FAILED,  /* once: `error` and `diag` say why; the old rig stays */
};

/* Starts with the stage's own rig. Returns 0 or -ENOMEM. */
int rig_swap_init(struct rig_swap *swap, const struct stage *stage, int wake_fd);
void rig_swap_finish(struct rig_swap *swap); /* the solver must not run; a zeroed one is fine */

/* Loads the rig of the config again. Returns 0, -EBUSY while one is under way, or what
 * pthread_create() says. */
int rig_swap_begin(struct rig_swap *swap);

/* After every wake. `solver_runs`: else nobody but us can take the new rig. */
enum rig_swap_state rig_swap_poll(struct rig_swap *swap, bool solver_runs);

/* Of the rig in use, as stagectl calibrate list has it; 0: not one of those. */
uint32_t rig_swap_number(const struct rig_swap *swap);

/* The calibration of a marker set. */
const char *rig_swap_revision(const struct rig_swap *swap, uint32_t serial);
