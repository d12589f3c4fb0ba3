/*
 * A calibration for people: one HTML page that needs nothing else, with drawings in it. The same
 * calibration gives the same bytes.
 */
#pragma once

#include "base/diag.h"
#include "calib/board/coverage.h"
#include "calib/rig/before.h"
#include "calib/rig/rig_write.h"

struct report_facts {
	const struct rig_facts *rig;
	const char *revision;
	const struct camera_coverage *coverage; /* per camera */
	const struct camera_move *moves;        /* per camera */
	const char *before;                     /* "0002", "" for none */
	const char *wave_next;                  /* the worst place, in words */
	bool scale_refused;
	double scale; /* of the rig before; 1 when it is the same */
};

/* Makes `path`. Returns 0 or a negative errno with a message. */
int report_write(const char *path, const struct report_facts *facts, struct diag *diag);
