/*
 * A scene played at blob level under the watch for moved cameras, as the station keeps it. Cameras
 * are moved in the rig, not on the stage: which of the two is wrong nobody can tell.
 */
#pragma once

#include "sim/play.h"
#include "track/aim_check.h"
#include "track/sync/ledger.h"

/* Large: not for a stack. */
struct aim_play {
	struct sim_play play;
	struct aim_check check;
	struct ledger ledger;
	uint64_t shot; /* the next */
};

int aim_play_init(struct aim_play *aim, const char *scene, uint64_t seed, uint32_t camera_count);
void aim_play_finish(struct aim_play *aim);

double aim_play_rate_hz(const struct aim_play *aim);
void aim_play_shot(struct aim_play *aim);
void aim_play_seconds(struct aim_play *aim, double seconds);

/* Turned about its own axes (x right, y down, z forward), then shifted along them. */
void aim_play_move(struct aim_play *aim, uint32_t camera, struct vec3 turn_rad,
		   struct vec3 shift_m);

/* Plays until a camera is named that was not, or the time is over.
 * Returns the seconds that it took, or NAN. */
double aim_play_until_named(struct aim_play *aim, double seconds, uint32_t *camera);

/* Puts the camera back to `before`, and waits until nothing is left of its having been moved. */
void aim_play_put_back(struct aim_play *aim, uint32_t camera, struct pose before);
