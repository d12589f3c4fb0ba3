/*
 * Sees a pose come and go: the face leaves its neutral (reached), stands still away from it (held),
 * comes back (returned). Pure.
 */
#pragma once

#include "calib/actor/actor.h"

enum actor_pose_phase {
	POSE_WAITING, /* the face is still neutral */
	POSE_REACHED,
	POSE_HELD,
	POSE_RETURNED,
};

struct actor_pose {
	/* the neutral, until the next begin */
	uint32_t count;
	bool on_face[LABEL_MAX]; /* and known in the neutral */
	struct vec3 neutral_m[LABEL_MAX];

	enum actor_pose_phase phase;
	bool was_held;
	double moved_m, moved_max_m; /* from neutral: rms of the markers that moved most */
	/* of every marker, when it was last seen; a closed lid hides its own */
	double last_moved_m[LABEL_MAX];
	int64_t last_seen_ns[LABEL_MAX]; /* 0 = not since the pose was asked for */
	int64_t still_since_ns, back_since_ns, reached_ns; /* 0 = not */
	int64_t marked_ns; /* when `marked_m` was taken, to tell motion */
	bool marked[LABEL_MAX];
	struct vec3 marked_m[LABEL_MAX];
};

/* Waits for the next pose; the neutral stays what it was. */
void actor_pose_next(struct actor_pose *pose);

/* Takes a shot in which the head was found. Returns the phase. */
enum actor_pose_phase actor_pose_step(struct actor_pose *pose, const struct actor_shot *shot);
