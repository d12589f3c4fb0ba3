/*
 * Where each marker of the layout should be in the coordinates of its frame (head or segment): from
 * its own motion while it was seen a moment ago, else from what its neighbours do now.
 */
#pragma once

#include <stdbool.h>

#include "track/label/expression.h"
#include "track/layout.h"
#include "track/tracker_state.h"

struct prediction {
	struct vec3 local_m; /* coordinates of the label's frame */
	double sigma_m;      /* per axis */
	bool recent;         /* from its own motion, not from its neighbours alone */
};

struct predictions {
	uint32_t count;
	bool fresh[FRAME_MAX]; /* only just found: nothing is known of it but the layout */
	struct prediction labels[LABEL_MAX];
};

/* Frames, and the neighbours of every label: the nearest other skin markers of the same face that
 * are not across the lips or the lids, with a prior for how alike they move. */
void predict_init(struct tracker_state *state, const struct layout *layout);

/* Two groups across the lips or the lids: their markers lie close and part. */
bool predict_opposes(const char *group, const char *other);

/* Skin may move by a marker's distance from shot to shot: its own motion tells least. */
bool predict_far_apart(const struct tracker_state *state);

/* Own motion only. */
void predict_motion(const struct tracker_state *state, int64_t now_ns, struct predictions *out);

/* The same, moved by what the neighbours did, or by what the whole face has `told`: `seen_m[k]` is
 * where label k is now, valid where seen[k]. */
void predict_from_neighbours(const struct tracker_state *state, int64_t now_ns,
			     const struct predictions *motion, const bool *seen,
			     const struct vec3 *seen_m, const struct told *told,
			     struct predictions *out);

/* By what the whole face has `told` where that is surer than its own motion. */
void predict_from_face(const struct predictions *motion, const struct told *told,
		       struct predictions *out);

/* Where the neighbours tell that a label is, and how sure that is. Returns how many spoke. */
int predict_told(const struct tracker_state *state, const struct label_state *label,
		 const bool *seen, const struct vec3 *seen_m, struct vec3 *told_m, double *sigma_m);

/* Learns from one shot how alike neighbours move and, of the heads in `anchored` (their rigid
 * markers hold them), where each marker rests. */
void predict_learn(struct tracker_state *state, double dt_s, const bool *anchored, const bool *seen,
		   const struct vec3 *seen_m);
