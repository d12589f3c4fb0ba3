/*
 * The calibration of one actor, from the first neutral to his file: what is asked for, captured,
 * kept and learned.
 */
#pragma once

#include "ctl/calibrate/actor_feed.h"
#include "ctl/calibrate/actor_journal.h"
#include "ctl/calibrate/actor_screen.h"

struct actor_wish {
	const char *name; /* of the actor, and of his file */
	const char *out_dir;
	bool fresh;    /* begins anew */
	bool anyway;   /* takes a neutral far from the layout */
	double pose_s; /* without a terminal: how long a pose is waited for */
};

/* Asks until all is captured, an interrupt comes or the feed ends; what was captured is in the
 * journal by then. Returns an exit code, with messages. */
int actor_session_run(struct actor_feed *feed, struct actor_screen *screen,
		      const struct actor_wish *wish, struct diag *diag);
