/*
 * The energy of motion is that of the few markers that move most: a wink moves no others.
 */
#include "calib/actor/actor_pose.h"

#include <string.h>

#include "base/clock.h"

#define MOST 4 /* markers that move most */
#define REACHED_M 0.0010
#define BACK_M 0.0006
#define BACK_SHARE 0.3 /* of the pose's largest motion: people do not come back exactly */
#define BACK_NS (NS_PER_S * 15 / 100)
#define MARK_NS (NS_PER_S / 10)
#define STILL_M 0.0005 /* of motion in the time of a mark */
#define HELD_NS (NS_PER_S / 5)
#define HIDDEN_NS (3 * NS_PER_S) /* so long one that hides is taken to be where it was */

void actor_pose_next(struct actor_pose *pose)
{
	pose->phase = POSE_WAITING;
	pose->was_held = false;
	pose->moved_m = pose->moved_max_m = 0;
	pose->still_since_ns = pose->back_since_ns = pose->reached_ns = pose->marked_ns = 0;
	memset(pose->last_seen_ns, 0, sizeof(pose->last_seen_ns));
}

/* Keeps the MOST largest, largest first. */
static void insert(double largest_m[MOST], double d_m)
{
	for (int k = 0; k < MOST; k++)
		if (d_m > largest_m[k]) {
			double other_m = largest_m[k];

			largest_m[k] = d_m;
			d_m = other_m;
		}
}

/* The largest of all is left out: it may be another's. */
static double energy_m(const double largest_m[MOST])
{
	double sum = 0;

	for (int k = 1; k < MOST; k++)
		sum += largest_m[k] * largest_m[k];
	return sqrt(sum / (MOST - 1));
}

static double from_neutral_m(struct actor_pose *pose, const struct actor_shot *shot)
{
	double largest_m[MOST] = {0};
	int64_t now_ns = shot->mid_exposure_ns;

	for (uint32_t i = 0; i < pose->count; i++) {
		if (!pose->on_face[i])
			continue;
		if (shot->seen[i]) {
			pose->last_moved_m[i] = vec3_distance(shot->p_m[i], pose->neutral_m[i]);
			pose->last_seen_ns[i] = now_ns;
		}
		if (pose->last_seen_ns[i] && now_ns - pose->last_seen_ns[i] < HIDDEN_NS)
			insert(largest_m, pose->last_moved_m[i]);
	}
	return energy_m(largest_m);
}

static double since_mark_m(const struct actor_pose *pose, const struct actor_shot *shot)
{
	double largest_m[MOST] = {0};

	for (uint32_t i = 0; i < pose->count; i++)
		if (pose->on_face[i] && pose->marked[i] && shot->seen[i])
			insert(largest_m, vec3_distance(shot->p_m[i], pose->marked_m[i]));
	return energy_m(largest_m);
}

static void mark(struct actor_pose *pose, const struct actor_shot *shot)
{
	pose->marked_ns = shot->mid_exposure_ns;
	for (uint32_t i = 0; i < pose->count; i++) {
		pose->marked[i] = shot->seen[i];
		pose->marked_m[i] = shot->p_m[i];
	}
}

/* Since when the face has not moved. */
static void watch_motion(struct actor_pose *pose, const struct actor_shot *shot)
{
	if (pose->marked_ns && shot->mid_exposure_ns - pose->marked_ns < MARK_NS)
		return;
	if (!pose->marked_ns || since_mark_m(pose, shot) > STILL_M)
		pose->still_since_ns = 0;
	else if (!pose->still_since_ns)
		pose->still_since_ns = pose->marked_ns;
	mark(pose, shot);
}

static void watch_return(struct actor_pose *pose, int64_t now_ns)
{
	if (pose->moved_m > fmax(BACK_M, BACK_SHARE * pose->moved_max_m))
		pose->back_since_ns = 0;
	else if (!pose->back_since_ns)
		pose->back_since_ns = now_ns;
	if (pose->back_since_ns && now_ns - pose->back_since_ns >= BACK_NS)
		pose->phase = POSE_RETURNED;
}

enum actor_pose_phase actor_pose_step(struct actor_pose *pose, const struct actor_shot *shot)
{
	int64_t now_ns = shot->mid_exposure_ns;

	watch_motion(pose, shot);
	pose->moved_m = from_neutral_m(pose, shot);
	pose->moved_max_m = fmax(pose->moved_max_m, pose->moved_m);
	if (pose->phase == POSE_WAITING && pose->moved_m > REACHED_M) {
		pose->phase = POSE_REACHED;
		pose->reached_ns = now_ns;
	}
	if (pose->phase == POSE_REACHED && pose->still_since_ns &&
	    pose->still_since_ns > pose->reached_ns && now_ns - pose->still_since_ns >= HELD_NS) {
		pose->phase = POSE_HELD;
		pose->was_held = true;
	}
	if (pose->phase == POSE_REACHED || pose->phase == POSE_HELD)
		watch_return(pose, now_ns);
	return pose->phase;
}
