/*
 * Where a head is in the shot, before its markers are looked for. Between two shots it turns and
 * starts as it likes: at thirty a second it may be several millimetres off what its motion told,
 * and by as much all of its markers, of which lips that meet and neighbours on the skin are nearer
 * to each other. So a few markers are looked for first, and when most are off, more of them, and
 * the head is fitted to those. Pure and real-time safe.
 */
#pragma once

#include <stdbool.h>

#include "track/label/label.h"
#include "track/match/match.h"
#include "track/tracker_state.h"

/* Moves the poses of the heads that are followed to where the shot shows them, given what is
 * expected of them and the prepared seeds; true when one was, so that the seeds are to be made
 * anew. Uses the matcher's candidates and what is nearby as room to work in. */
bool seek_heads(const struct tracker_state *state, struct labelling *labelling,
		struct matcher *matcher);
