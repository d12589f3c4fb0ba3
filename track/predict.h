/*
 * Where each marker of the layout should be in head coordinates: from its own motion while it was
 * seen a moment ago, else from what its neighbours do now.
 */
#pragma once

#include <stdbool.h>

#include "track/layout.h"
#include "track/tracker_state.h"

struct prediction {
	struct vec3 local_m; /* head coordinates */
	double sigma_m;      /* per axis */
	bool recent;         /* from its own motion, not from its neighbours alone */
};

struct predictions {
	bool fresh_start; /* the head was only just found: nothing is known but the layout */
	uint32_t count;
	struct prediction labels[LABEL_MAX];
};

/* Fills the neighbours of every label: the nearest other skin markers, with a prior for how alike
 * they move. */
void predict_init(struct tracker_state *state, const struct layout *layout);

/* Own motion only. */
void predict_motion(const struct tracker_state *state, const struct layout *layout, int64_t now_ns,
		    struct predictions *out);

/* The same, moved by what the neighbours did: `seen_m[k]` is where label k is now, valid where
 * seen[k]. */
void predict_from_neighbours(const struct tracker_state *state, const struct layout *layout,
			     int64_t now_ns, const struct predictions *motion, const bool *seen,
			     const struct vec3 *seen_m, struct predictions *out);

/* Displacement of a label as its neighbours tell it, and how sure that is. Returns how many
 * neighbours spoke. */
int predict_displacement(const struct label_state *label, const struct layout *layout,
			 const bool *seen, const struct vec3 *seen_m, struct vec3 *displacement_m,
			 double *sigma_m);

/* Learns from one shot how alike neighbours move and, while `anchored` (the rigid markers hold the
 * head), where each marker rests. */
void predict_learn(struct tracker_state *state, const struct layout *layout, double dt_s,
		   bool anchored, const bool *seen, const struct vec3 *seen_m);
