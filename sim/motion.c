/*
 * Seeded signals for every expression and for the head's turns, shakes and sway.
 */
#include "sim/motion.h"

#include <string.h>

#include "base/rng.h"
#include "sim/script.h"

#define MM 1e-3
#define RAD (M_PI / 180.0)
#define EASE_IN_S 0.3 /* the face leaves neutral within this time */

/* The actor sits at the stage's origin and looks along +y. */
static const struct vec3 SEAT_M = {0, 0, 1.2};
static const struct vec3 NECK_M = {0, -110 * MM, -25 * MM}; /* the head turns about it */

struct band {
	double low_hz, high_hz;
};

static const struct band SPEECH = {2.7, 4.0}, MIMIC = {0.4, 2.5};
static const struct band TURN = {0.1, 0.45}, SHAKE = {1.2, 3.0}, SWAY = {0.15, 1.0};

/* Largest excursions: turns and shakes in degrees, sway in mm; head axes x, y, z. */
static const double TURN_DEG[3] = {13, 30, 7};
static const double SHAKE_DEG[3] = {5, 9, 3};
static const double SWAY_MM[3] = {35, 20, 40};

static const struct {
	struct band band;
	double scale;
} DRIVE[EXPRESSION_COUNT] = {
	[EXPRESSION_JAW_OPEN] = {SPEECH, 1.0}, [EXPRESSION_SMILE] = {MIMIC, 0.8},
	[EXPRESSION_STRETCH] = {SPEECH, 0.8},  [EXPRESSION_PUCKER] = {SPEECH, 0.8},
	[EXPRESSION_LIP_DROP] = {SPEECH, 1.0}, [EXPRESSION_SNARL] = {MIMIC, 0.5},
	[EXPRESSION_BLINK] = {MIMIC, 0.9},     [EXPRESSION_BROW_L] = {MIMIC, 0.9},
	[EXPRESSION_BROW_R] = {MIMIC, 0.9},    [EXPRESSION_FROWN] = {MIMIC, 0.7},
};

static struct signal signal_make(struct rng *rng, struct band band)
{
	struct signal signal;
	double sum = 0;

	for (int i = 0; i < MOTION_SINES; i++) {
		double place = (i + rng_uniform(rng)) / MOTION_SINES;

		signal.hz[i] = band.low_hz + (band.high_hz - band.low_hz) * place;
		signal.phase_rad[i] = 2.0 * M_PI * rng_uniform(rng);
		signal.amplitude[i] = 0.4 + rng_uniform(rng);
		sum += signal.amplitude[i];
	}
	for (int i = 0; i < MOTION_SINES; i++)
		signal.amplitude[i] /= sum;
	return signal;
}

static double signal_at(const struct signal *signal, double time_s)
{
	double value = 0;

	for (int i = 0; i < MOTION_SINES; i++)
		value += signal->amplitude[i] *
			 sin(2.0 * M_PI * signal->hz[i] * time_s + signal->phase_rad[i]);
	return value;
}

static struct vec3 random_vector(struct rng *rng, double half_width)
{
	double x = 2.0 * rng_uniform(rng) - 1.0;
	double y = 2.0 * rng_uniform(rng) - 1.0;
	double z = 2.0 * rng_uniform(rng) - 1.0;

	return vec3_scale((struct vec3){x, y, z}, half_width);
}

void motion_init(struct motion *motion, int performance, uint64_t seed)
{
	struct rng rng;

	memset(motion, 0, sizeof(*motion));
	rng_init(&rng, seed, 2);
	motion->still = performance == SIM_STILL;
	motion->seat_m = vec3_add(SEAT_M, random_vector(&rng, 5 * MM));
	motion->seat_turn_rad = random_vector(&rng, 3 * RAD);
	motion->turn_rad = performance == SIM_TURNING ? 60 * RAD : 0;
	motion->turn_hz = 0.16 + 0.04 * rng_uniform(&rng);
	motion->turn_phase_rad = 0;
	for (int e = 0; e < EXPRESSION_COUNT; e++) {
		motion->expressions[e] = signal_make(&rng, DRIVE[e].band);
		motion->expression_scale[e] = DRIVE[e].scale;
	}
	for (int axis = 0; axis < 3; axis++) {
		motion->turn[axis] = signal_make(&rng, TURN);
		motion->shake[axis] = signal_make(&rng, SHAKE);
		motion->sway[axis] = signal_make(&rng, SWAY);
	}
}

static double ease_in(double time_s)
{
	double u = fmin(fmax(time_s / EASE_IN_S, 0.0), 1.0);

	return u * u * (3.0 - 2.0 * u);
}

void motion_expressions(const struct motion *motion, double time_s,
			double weights[EXPRESSION_COUNT])
{
	double gain = motion->still ? 0.0 : ease_in(time_s);

	for (int e = 0; e < EXPRESSION_COUNT; e++)
		weights[e] = gain * motion->expression_scale[e] *
			     (0.5 + 0.5 * signal_at(&motion->expressions[e], time_s));
}

static double axis_angle_rad(const struct motion *motion, int axis, double time_s)
{
	double small = axis == 1 && motion->turn_rad > 0 ? 0.15 : 1.0;

	return small * TURN_DEG[axis] * RAD * signal_at(&motion->turn[axis], time_s) +
	       SHAKE_DEG[axis] * RAD * signal_at(&motion->shake[axis], time_s);
}

/* Head axes in the stage: left = -x, up = +z, out of the face = +y. */
static const struct pose FACING = {.r = {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}}};

static struct pose turned(const struct motion *motion, double time_s)
{
	struct pose seat = pose_from_rotation_vector(motion->seat_turn_rad);

	if (motion->still)
		return seat;
	double large = motion->turn_rad *
		       sin(2.0 * M_PI * motion->turn_hz * time_s + motion->turn_phase_rad);
	double yaw = large + axis_angle_rad(motion, 1, time_s);
	struct pose ry = pose_from_rotation_vector((struct vec3){0, yaw, 0});
	struct pose rx =
		pose_from_rotation_vector((struct vec3){axis_angle_rad(motion, 0, time_s), 0, 0});
	struct pose rz =
		pose_from_rotation_vector((struct vec3){0, 0, axis_angle_rad(motion, 2, time_s)});
	struct pose yx = pose_compose(&ry, &rx);
	struct pose yxz = pose_compose(&yx, &rz);

	return pose_compose(&yxz, &seat);
}

struct pose motion_head(const struct motion *motion, double time_s)
{
	struct pose turn = turned(motion, time_s);
	struct vec3 sway = {0, 0, 0};

	if (!motion->still)
		sway = (struct vec3){SWAY_MM[0] * MM * signal_at(&motion->sway[0], time_s),
				     SWAY_MM[1] * MM * signal_at(&motion->sway[1], time_s),
				     SWAY_MM[2] * MM * signal_at(&motion->sway[2], time_s)};
	turn.t = vec3_add(vec3_sub(NECK_M, pose_rotate(&turn, NECK_M)), sway);
	struct pose head = pose_compose(&FACING, &turn);

	head.t = vec3_add(head.t, motion->seat_m);
	return head;
}
