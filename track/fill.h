/*
 * Where a marker is that nobody sees, and how well that is known. What its prediction is worth is
 * measured all the time: each marker is now and then taken as if it had been lost, and held against
 * where it really is until it is seen no more or for a while. Pure and real-time safe.
 */
#pragma once

#include "track/label/label.h"

struct filled {
	struct vec3 local_m; /* coordinates of the label's frame */
	double sigma_m;      /* per axis */
};

/* After the shot's names: learns from the labels that three cameras see. */
void fill_learn(struct tracker_state *state, const struct labelling *labelling,
		const struct point *points, int64_t now_ns);

/* The place of a label that is not named in this shot. */
struct filled fill_place(const struct tracker_state *state, const struct labelling *labelling,
			 const struct point *points, uint32_t label, int64_t now_ns);
