/*
 * Seeded signals for the head's turns, shakes and sway.
 */
#include "sim/face/motion.h"

#include <string.h>

#define MM 1e-3
#define RAD (M_PI / 180.0)
#define LARGE_TURN_DEG 63
#define TRIAL_S 20.0 /* in which the peak speed is looked for */

/* The head turns about it; head coordinates. */
static const struct vec3 NECK_M = {0, -110 * MM, -25 * MM};

static const struct band TURN = {0.1, 0.45}, SHAKE = {1.2, 3.0}, SWAY = {0.15, 1.0};
static const struct band FAST_SHAKE = {1.8, 3.0};

/* Largest excursions, head axes x, y, z. */
static const double TURN_DEG[3] = {13, 30, 7};
static const double SWAY_MM[3] = {35, 20, 40};

/* How a shake is shared by nods, shakes proper and tilts. */
static const double SHAKE_SHARE[3] = {5, 9, 3}, FAST_SHAKE_SHARE[3] = {2, 9, 1};

/* The face's outermost places, by which its speed is measured. */
static const struct vec3 OUTLINE_M[] = {{0, -45 * MM, 120 * MM},
					{0, 60 * MM, 85 * MM},
					{65 * MM, 10 * MM, 50 * MM},
					{-65 * MM, 10 * MM, 50 * MM},
					{0, -95 * MM, 85 * MM}};

static struct vec3 random_vector(struct rng *rng, double half_width)
{
	double x = 2.0 * rng_uniform(rng) - 1.0;
	double y = 2.0 * rng_uniform(rng) - 1.0;
	double z = 2.0 * rng_uniform(rng) - 1.0;

	return vec3_scale((struct vec3){x, y, z}, half_width);
}

/* Head axes in the stage: left = -x, up = +z, out of the face = +y; then turned about z. */
static struct pose seat_of(const struct sim_actor_script *script, struct rng *rng)
{
	const struct pose ahead = {.r = {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}}};
	struct vec3 off_m = random_vector(rng, 5 * MM);
	struct pose slouch = pose_from_rotation_vector(random_vector(rng, 3 * RAD));
	struct pose facing =
		pose_from_rotation_vector((struct vec3){0, 0, script->facing_deg * RAD});

	facing.t = vec3_add(script->seat_m, off_m);
	struct pose seat = pose_compose(&facing, &ahead);

	slouch.t = vec3_sub(NECK_M, pose_rotate(&slouch, NECK_M));
	return pose_compose(&seat, &slouch);
}

static struct pose about(int axis, double angle_rad)
{
	struct vec3 w = {axis == 0 ? angle_rad : 0, axis == 1 ? angle_rad : 0,
			 axis == 2 ? angle_rad : 0};

	return pose_from_rotation_vector(w);
}

/* Yaw, then nod, then tilt, about the neck. */
static struct pose turned(const double angle_rad[3])
{
	struct pose ry = about(1, angle_rad[1]), rx = about(0, angle_rad[0]);
	struct pose rz = about(2, angle_rad[2]);
	struct pose yx = pose_compose(&ry, &rx);
	struct pose turn = pose_compose(&yx, &rz);

	turn.t = vec3_sub(NECK_M, pose_rotate(&turn, NECK_M));
	return turn;
}

static struct pose shaken(const struct motion *motion, double time_s)
{
	double angle_rad[3];

	for (int axis = 0; axis < 3; axis++)
		angle_rad[axis] =
			motion->shake_scale[axis] * signal_at(&motion->shake[axis], time_s);
	return turned(angle_rad);
}

static double shake_speed_m_s(const struct motion *motion)
{
	const double step_s = 1e-3;
	double top_m_s = 0;

	for (double t = 0; t < TRIAL_S; t += 0.02) {
		struct pose before = shaken(motion, t), after = shaken(motion, t + step_s);

		for (size_t i = 0; i < sizeof(OUTLINE_M) / sizeof(OUTLINE_M[0]); i++)
			top_m_s = fmax(top_m_s, vec3_distance(pose_apply(&before, OUTLINE_M[i]),
							      pose_apply(&after, OUTLINE_M[i])) /
							step_s);
	}
	return top_m_s;
}

static void set_shakes(struct motion *motion, double speed_m_s, const double share[3])
{
	for (int axis = 0; axis < 3; axis++)
		motion->shake_scale[axis] = RAD * share[axis];
	for (int pass = 0; pass < 3; pass++) {
		double scale = speed_m_s / shake_speed_m_s(motion);

		if (speed_m_s <= 0)
			scale = 0;
		for (int axis = 0; axis < 3; axis++)
			motion->shake_scale[axis] *= scale;
		if (scale == 0)
			return;
	}
}

void motion_init(struct motion *motion, const struct sim_actor_script *script, uint64_t seed)
{
	bool shaking = script->performance == SIM_SHAKING;
	bool turning = script->performance == SIM_TURNING;
	struct rng rng;

	memset(motion, 0, sizeof(*motion));
	rng_init(&rng, seed, 2);
	motion->still = script->performance == SIM_STILL;
	motion->rt_stage_seat = seat_of(script, &rng);
	motion->turn_rad = turning ? LARGE_TURN_DEG * RAD : 0;
	motion->turn_hz = 0.16 + 0.04 * rng_uniform(&rng);
	for (int axis = 0; axis < 3; axis++) {
		bool small = axis == 1 && turning;

		motion->drift_scale[axis] = (small ? 0.15 : 1.0) * TURN_DEG[axis] * RAD;
		motion->turn[axis] = signal_make(&rng, TURN);
		motion->shake[axis] = signal_make(&rng, shaking ? FAST_SHAKE : SHAKE);
		motion->sway[axis] = signal_make(&rng, SWAY);
	}
	if (!motion->still)
		set_shakes(motion, script->shake_speed_m_s,
			   shaking ? FAST_SHAKE_SHARE : SHAKE_SHARE);
}

struct pose motion_neck(const struct motion *motion, double time_s)
{
	struct pose neck = motion->rt_stage_seat;
	struct vec3 sway = {0, 0, 0};

	if (!motion->still)
		sway = (struct vec3){SWAY_MM[0] * MM * signal_at(&motion->sway[0], time_s),
				     SWAY_MM[1] * MM * signal_at(&motion->sway[1], time_s),
				     SWAY_MM[2] * MM * signal_at(&motion->sway[2], time_s)};
	neck.t = pose_apply(&neck, sway);
	return neck;
}

struct pose motion_head(const struct motion *motion, double time_s, double turn_rad)
{
	struct pose neck = motion_neck(motion, time_s);
	double angle_rad[3] = {0, turn_rad, 0};

	if (!motion->still) {
		angle_rad[1] += motion->turn_rad * sin(2.0 * M_PI * motion->turn_hz * time_s);
		for (int axis = 0; axis < 3; axis++)
			angle_rad[axis] +=
				motion->drift_scale[axis] * signal_at(&motion->turn[axis], time_s) +
				motion->shake_scale[axis] * signal_at(&motion->shake[axis], time_s);
	}
	struct pose turn = turned(angle_rad);

	return pose_compose(&neck, &turn);
}
