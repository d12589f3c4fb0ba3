/*
 * What skin can do: displacement bases, one displacement of each marker at weight 1; and the named
 * poses that are made of them, expressions and phonemes (visemes, as MPEG-4 and Disney's speech
 * charts group them). Displacements add up linearly, so that a face is as band-limited as the
 * weights are.
 */
#pragma once

#include "base/geometry.h"

enum face_basis {
	BASIS_JAW_OPEN,
	BASIS_JAW_SIDE, /* to the left */
	BASIS_JAW_FORWARD,
	BASIS_SMILE_L,
	BASIS_SMILE_R,
	BASIS_STRETCH,
	BASIS_PUCKER,
	BASIS_FUNNEL,
	BASIS_LIP_DROP,
	BASIS_LIP_RAISE,
	BASIS_LIP_PRESS,
	BASIS_CORNERS_DOWN,
	BASIS_PUFF,
	BASIS_CHIN_RAISE,
	BASIS_SNARL_L,
	BASIS_SNARL_R,
	BASIS_BLINK_L,
	BASIS_BLINK_R,
	BASIS_SQUINT,
	BASIS_BROW_L,
	BASIS_BROW_R,
	BASIS_FROWN,
	BASIS_COUNT,
};

#define JAW_CHIN_M 0.018 /* what weight 1 of BASIS_JAW_OPEN lowers the chin by, about */

/* Where a marker is on the skin, all that the bases ask. */
struct face_site {
	double azimuth_deg, elevation_deg;
	struct vec3 p_m;
	double jaw_share; /* 0 = upper face, 1 = moves with the jaw bone */
};

/* How much of the jaw's motion the skin follows there. */
double face_jaw_share(double azimuth_deg, double elevation_deg);

/* All bases but BASIS_LIP_PRESS, which takes two markers. */
void face_shift(const struct face_site *site, struct vec3 shift_m[BASIS_COUNT]);

/* The hinge's rotation of a normal by the jaw alone, at weight 1; radians about the head's x. */
double face_jaw_turn_rad(const struct face_site *site);

#define FACE_POSE_TERMS 6

struct face_pose {
	const char *name;
	struct {
		enum face_basis basis;
		double weight;
	} terms[FACE_POSE_TERMS]; /* up to the first of weight 0 */
};

/* The poses of an actor calibration, in its order: expressions, then phonemes. */
#define FACE_POSE_COUNT 64
#define FACE_PHONEME_COUNT 18
#define FACE_PHONEME_FIRST (FACE_POSE_COUNT - FACE_PHONEME_COUNT)
extern const struct face_pose FACE_POSES[FACE_POSE_COUNT];

/* The pose of that name, or -1. */
int face_pose_find(const char *name);

/* Adds `scale` times the pose. */
void face_pose_add(int pose, double scale, double weights[BASIS_COUNT]);
