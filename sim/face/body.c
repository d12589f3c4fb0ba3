/*
 * Torso, upper arms and forearms as ellipsoids that turn slowly about their joints.
 */
#include "sim/face/body.h"

#include <stdio.h>
#include <string.h>

#define MM 1e-3
#define RAD (M_PI / 180.0)
#define STEM_M 4e-3 /* large markers stand on bases */

const char *const BODY_SEGMENT_NAMES[SEGMENT_COUNT] = {"torso", "upper_arm_l", "upper_arm_r",
						       "forearm_l", "forearm_r"};

static const struct band SLOW = {0.08, 0.7};

/* The left arm; the right one is its mirror image. */
static const struct vec3 SHOULDER_M = {185 * MM, -255 * MM, -50 * MM};
static const struct vec3 ELBOW_M = {245 * MM, -520 * MM, -70 * MM};
static const struct vec3 WRIST_M = {190 * MM, -545 * MM, 170 * MM};
static const struct vec3 NECK_BASE_M = {0, -180 * MM, -40 * MM};
static const struct vec3 CHEST_M = {0, -420 * MM, -50 * MM};

/* Largest bends in degrees about head axes x, y, z. */
static const double BEND_DEG[SEGMENT_COUNT][3] = {
	{5, 7, 3}, {14, 8, 9}, {14, 8, 9}, {22, 14, 8}, {22, 14, 8}};

/* Directions from the middle of the flesh: outwards (of the torso: to the left), up along the bone,
 * forward. Left and right
 * are unlike, as are all distances within a segment, so that they fit in one way only. */
static const struct body_spot {
	const char *name, *group;
	enum body_segment segment;
	double outwards, up, forward, diameter_mm;
} SPOTS[] = {
	{"shoulder_l_1", "shoulder", SEGMENT_TORSO, 0.62, 0.78, 0.10, 14},
	{"shoulder_l_2", "shoulder", SEGMENT_TORSO, 0.75, 0.55, 0.36, 12},
	{"shoulder_r_1", "shoulder", SEGMENT_TORSO, -0.55, 0.83, 0.05, 14},
	{"shoulder_r_2", "shoulder", SEGMENT_TORSO, -0.80, 0.50, 0.30, 12},
	{"chest_1", "chest", SEGMENT_TORSO, 0.05, 0.62, 0.78, 14},
	{"chest_2", "chest", SEGMENT_TORSO, 0.45, 0.25, 0.85, 12},
	{"chest_3", "chest", SEGMENT_TORSO, -0.36, 0.05, 0.93, 14},
	{"back_1", "back", SEGMENT_TORSO, 0.05, 0.70, -0.71, 14},
	{"back_2", "back", SEGMENT_TORSO, 0.50, 0.25, -0.83, 14},
	{"back_3", "back", SEGMENT_TORSO, -0.40, 0.05, -0.91, 12},
	{"upper_arm_l_1", "upper_arm", SEGMENT_UPPER_ARM_L, 0.80, 0.50, 0.33, 12},
	{"upper_arm_l_2", "upper_arm", SEGMENT_UPPER_ARM_L, 0.90, -0.05, -0.43, 9},
	{"upper_arm_l_3", "upper_arm", SEGMENT_UPPER_ARM_L, 0.45, -0.55, 0.70, 12},
	{"upper_arm_r_1", "upper_arm", SEGMENT_UPPER_ARM_R, 0.75, 0.60, -0.28, 12},
	{"upper_arm_r_2", "upper_arm", SEGMENT_UPPER_ARM_R, 0.70, 0.10, 0.70, 9},
	{"upper_arm_r_3", "upper_arm", SEGMENT_UPPER_ARM_R, 0.85, -0.50, 0.17, 12},
	{"forearm_l_1", "forearm", SEGMENT_FOREARM_L, 0.50, 0.60, 0.62, 9},
	{"forearm_l_2", "forearm", SEGMENT_FOREARM_L, 0.20, -0.15, 0.97, 12},
	{"forearm_l_3", "forearm", SEGMENT_FOREARM_L, 0.68, -0.70, 0.22, 9},
	{"forearm_r_1", "forearm", SEGMENT_FOREARM_R, 0.25, 0.65, 0.72, 9},
	{"forearm_r_2", "forearm", SEGMENT_FOREARM_R, 0.62, 0.05, 0.78, 12},
	{"forearm_r_3", "forearm", SEGMENT_FOREARM_R, 0.10, -0.75, 0.65, 9},
};

_Static_assert(sizeof(SPOTS) / sizeof(SPOTS[0]) == BODY_MARKER_COUNT, "as many as promised");

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

static struct vec3 mirrored(struct vec3 p, int side, double size)
{
	return vec3_scale((struct vec3){side * p.x, p.y, p.z}, size);
}

/* y up the bone, x towards the subject's left, z what is left: forward, or above a forearm. */
static struct body_flesh flesh_along(struct vec3 upper, struct vec3 lower, double thick_m)
{
	struct vec3 y = vec3_unit(vec3_sub(upper, lower));
	struct vec3 z = vec3_unit(vec3_cross((struct vec3){1, 0, 0}, y));
	struct vec3 x = vec3_cross(y, z);

	return (struct body_flesh){
		.rt_neutral_flesh = {.r = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}},
				     .t = vec3_scale(vec3_add(upper, lower), 0.5)},
		.axes_m = {thick_m, 0.52 * vec3_distance(upper, lower), thick_m}};
}

static void set_bones(struct body *body, double size)
{
	body->joints_m[SEGMENT_TORSO] = vec3_scale(NECK_BASE_M, size);
	body->flesh[SEGMENT_TORSO] = (struct body_flesh){.rt_neutral_flesh = POSE_IDENTITY,
							 .axes_m = {180 * MM, 255 * MM, 115 * MM}};
	body->flesh[SEGMENT_TORSO].rt_neutral_flesh.t = vec3_scale(CHEST_M, size);
	for (int right = 0; right < 2; right++) {
		int side = right ? -1 : 1;
		struct vec3 shoulder = mirrored(SHOULDER_M, side, size);
		struct vec3 elbow = mirrored(ELBOW_M, side, size);
		struct vec3 wrist = mirrored(WRIST_M, side, size);

		body->joints_m[SEGMENT_UPPER_ARM_L + right] = shoulder;
		body->joints_m[SEGMENT_FOREARM_L + right] = elbow;
		body->flesh[SEGMENT_UPPER_ARM_L + right] =
			flesh_along(shoulder, elbow, 48 * MM * size);
		body->flesh[SEGMENT_FOREARM_L + right] = flesh_along(elbow, wrist, 38 * MM * size);
	}
}

static struct vec3 on_flesh(const struct body_flesh *flesh, struct vec3 toward, struct vec3 *normal)
{
	struct vec3 s = vec3_unit(toward), a = flesh->axes_m;
	struct vec3 n = vec3_unit((struct vec3){s.x / a.x, s.y / a.y, s.z / a.z});
	struct vec3 p = {s.x * a.x, s.y * a.y, s.z * a.z};

	*normal = pose_rotate(&flesh->rt_neutral_flesh, n);
	return pose_apply(&flesh->rt_neutral_flesh, vec3_add(p, vec3_scale(n, STEM_M)));
}

static void place_marker(struct body *body, int i, double reapplied_m, struct rng *rng,
			 struct rng *today_rng)
{
	const struct body_spot *spot = &SPOTS[i];
	struct body_marker *marker = &body->markers[i];
	const struct body_flesh *flesh = &body->flesh[spot->segment];
	bool right = spot->segment == SEGMENT_UPPER_ARM_R || spot->segment == SEGMENT_FOREARM_R;
	struct vec3 toward = {(right ? -1 : 1) * spot->outwards + spread(rng, 0.03),
			      spot->up + spread(rng, 0.03), spot->forward + spread(rng, 0.03)};
	struct layout_marker *wanted = &marker->wanted;

	snprintf(wanted->name, sizeof(wanted->name), "%s", spot->name);
	snprintf(wanted->group, sizeof(wanted->group), "%s", spot->group);
	snprintf(wanted->segment, sizeof(wanted->segment), "%s", BODY_SEGMENT_NAMES[spot->segment]);
	wanted->diameter_m = spot->diameter_mm * MM;
	wanted->neutral_m = on_flesh(flesh, toward, &marker->normal);
	marker->segment = spot->segment;
	marker->reflectivity = 1.0 + spread(rng, 0.1);
	struct vec3 off = {rng_normal(today_rng), rng_normal(today_rng), rng_normal(today_rng)};

	off = vec3_sub(off, vec3_scale(marker->normal, vec3_dot(off, marker->normal)));
	marker->neutral_m = vec3_add(wanted->neutral_m, vec3_scale(off, reapplied_m));
}

void body_init(struct body *body, bool still, double reapplied_m, uint64_t seed)
{
	struct rng rng, today_rng;

	memset(body, 0, sizeof(*body));
	rng_init(&rng, seed, 7);
	rng_init(&today_rng, seed, 8);
	body->still = still;
	set_bones(body, 1 + spread(&rng, 0.04));
	for (int i = 0; i < BODY_MARKER_COUNT; i++)
		place_marker(body, i, reapplied_m, &rng, &today_rng);
	for (int s = 0; s < SEGMENT_COUNT; s++)
		for (int axis = 0; axis < 3; axis++)
			body->bends[s][axis] = signal_make(&rng, SLOW);
}

static struct pose bent(const struct body *body, int segment, double time_s)
{
	struct vec3 joint = body->joints_m[segment];
	double w[3];

	for (int axis = 0; axis < 3; axis++)
		w[axis] = RAD * BEND_DEG[segment][axis] *
			  signal_at(&body->bends[segment][axis], time_s);
	struct pose turn = pose_from_rotation_vector((struct vec3){w[0], w[1], w[2]});

	turn.t = vec3_sub(joint, pose_rotate(&turn, joint));
	return turn;
}

void body_pose(const struct body *body, const struct pose *rt_stage_neck, double time_s,
	       struct pose rt_stage_neutral[SEGMENT_COUNT])
{
	static const int parents[SEGMENT_COUNT] = {-1, SEGMENT_TORSO, SEGMENT_TORSO,
						   SEGMENT_UPPER_ARM_L, SEGMENT_UPPER_ARM_R};

	for (int s = 0; s < SEGMENT_COUNT; s++) {
		const struct pose *parent =
			parents[s] < 0 ? rt_stage_neck : &rt_stage_neutral[parents[s]];
		struct pose turn = body->still ? POSE_IDENTITY : bent(body, s, time_s);

		rt_stage_neutral[s] = pose_compose(parent, &turn);
	}
}
