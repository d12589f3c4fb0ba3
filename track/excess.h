/*
 * What the views disagree by beyond their blobs' sigmas, learned from the residuals: of all cameras
 * as one number, and more of a camera that is off by itself, as one is that was bumped. Covariances
 * stay true by it on a rig that is less good than it says. Pure and real-time safe.
 */
#pragma once

#include "track/match/match.h"

void excess_learn(struct tracker_state *state, const struct matcher *matcher);
