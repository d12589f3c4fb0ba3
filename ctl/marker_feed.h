/*
 * Some seconds of spots and markers for a calibration: from the running station, or from a
 * recording.
 */
#pragma once

#include "base/diag.h"
#include "calib/rig/marker_shots.h"
#include "config/stage.h"

struct marker_feed_source {
	const char *from;       /* a recording's directory or config; NULL: the station */
	const char *socket_dir; /* of the station */
	double seconds;         /* of the station; a recording is taken whole */
	bool for_new_rig;       /* is refused at once where none can be put */
};

/* Large: not for a stack. */
struct marker_feed {
	struct stage stage;        /* as the recording or the station has it */
	struct marker_shots shots; /* cameras are those of the stage's rig */
};

/* Returns an exit code, with messages in `diag` or on stderr; then nothing is held. */
int marker_feed_open(struct marker_feed **out, const struct marker_feed_source *source,
		     struct diag *diag);
/* The recording's config and rig alone, for a new rig, without layout and shots. */
int marker_feed_open_rig(struct marker_feed **out, const char *from, struct diag *diag);
void marker_feed_close(struct marker_feed *feed); /* accepts NULL */
