/*
 * An adult head as truth: the markers on it, how they move with the skin, what glistens, and what
 * hides. Head coordinates: x to the subject's left, y up, z out of the face, origin in the middle;
 * metres.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "sim/face/face_basis.h"
#include "track/layout.h"

#define FACE_MARKER_MAX 192
#define FACE_GHOST_MAX 8

struct ellipsoid {
	struct vec3 centre_m, axes_m;
};

struct face_marker {
	struct layout_marker wanted; /* name, group and the place that the layout tells */
	struct vec3 neutral_m;       /* where it is today */
	struct vec3 normal;          /* of the neutral face, unit */
	struct vec3 shift_m[BASIS_COUNT];
	double jaw_turn_rad; /* of the normal at weight 1 */
	double reflectivity; /* 1 = nominal */
	bool on_nose;
	int tucks[2]; /* bases whose sum above FACE_TUCK hides it in a fold; BASIS_COUNT = none */
};

#define FACE_TUCK 0.72

enum face_gloss { GLOSS_TOOTH, GLOSS_EYE_L, GLOSS_EYE_R };

/* A glossy sphere, seen within an angle about its axis. */
struct face_ghost {
	enum face_gloss kind;
	struct vec3 centre_m, axis;
	double radius_m, cos_limit, brightness;
};

struct face {
	uint32_t marker_count;
	struct face_marker markers[FACE_MARKER_MAX]; /* skin, then the band */
	uint32_t ghost_count;
	struct face_ghost ghosts[FACE_GHOST_MAX];
	struct ellipsoid skull, nose;
};

struct face_options {
	int marker_count;   /* on the skin: 0, 35, 70 or 182 */
	double diameter_m;  /* 0: 1.5 mm, or 3.2 mm of 182 */
	double reapplied_m; /* standard deviation along the skin, per axis */
	bool teeth, eyes;   /* glisten */
};

/* The shape and the marker placement vary a little with the seed. Any marker count that is not in
 * the list above is taken for 70: see face_count_known(). */
void face_init(struct face *face, const struct face_options *options, uint64_t seed);
bool face_count_known(int marker_count);

/* Place and unit normal of a marker. */
struct vec3 face_marker_place(const struct face *face, uint32_t marker,
			      const double weights[BASIS_COUNT], struct vec3 *normal);

/* A closed lid or a deep fold has taken it in. */
bool face_marker_tucked(const struct face *face, uint32_t marker,
			const double weights[BASIS_COUNT]);

/* Between the lips; 0 when they are closed. */
double face_lips_parted_m(const double weights[BASIS_COUNT]);

/* `blink`: BASIS_BLINK_L or _R. From 0, open, to 1. */
double face_lid_closed(enum face_basis blink, const double weights[BASIS_COUNT]);

/* From 0, behind lips or lids, to the ghost's own. */
double face_ghost_brightness(const struct face_ghost *ghost, const double weights[BASIS_COUNT]);
