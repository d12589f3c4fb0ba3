/*
 * The tracker: one shot of blobs in, one marker set out.
 *
 *   predict head and markers -> match blobs over the cameras -> triangulate -> name -> head pose
 *
 * Points first, names after: blobs are joined into 3D points by geometry alone, and only then are
 * the points given names, so that a wrong guess about a name cannot bend a position.
 * Pure: no files, clocks, threads, logging or allocation. All state that lives from shot to shot is
 * one flat struct, so that a take can store it and a replay gives the same bits.
 */
#pragma once

#include "track/layout.h"
#include "track/observe.h"
#include "track/tracker_state.h"
#include "track/view.h"

struct tracker_settings {
	double match_gate_px;        /* a view this far from the point is not of it; default 1.0 */
	double calibration_sigma_px; /* calibration error per view, added to each blob's sigma;
					default 0.002 */
	double range_min_m, range_max_m; /* of a marker from a camera; default 0.1 and 20 */
};

struct tracker_settings tracker_settings_default(void);

/* What the tracker needs and never changes; borrowed from whoever owns rig and layout. Camera c of
 * every shot is views[c]; NULL where the camera does not take part (HD). */
struct tracker_rig {
	uint32_t camera_count;
	const struct view *views[CAMERA_MAX];
	const struct layout *layout;
	struct tracker_settings settings;
};

/* Working memory for one shot; large, so the caller keeps it. Contents never matter between shots:
 * what is prepared in it is made again where it is missing. */
struct tracker_scratch;
int tracker_scratch_create(struct tracker_scratch **out); /* 0 or -ENOMEM */
void tracker_scratch_destroy(struct tracker_scratch *scratch);

void tracker_state_init(struct tracker_state *state, const struct layout *layout);

/* Does ahead what the next shot needs and no blob is needed for, should it come a period after the
 * last one. Costs nothing when that is done already; changes no result. Real-time safe. */
void tracker_prepare(const struct tracker_state *state, struct tracker_scratch *scratch,
		     const struct tracker_rig *rig);

/* Real-time safe. `out` is overwritten except for its arrival, found and solved times. */
void tracker_run(struct tracker_state *state, struct tracker_scratch *scratch,
		 const struct tracker_rig *rig, const struct shot *shot, struct marker_set *out);
