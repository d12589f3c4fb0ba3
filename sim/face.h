/*
 * An adult head as truth: its surface, the markers on it and how expressions move them.
 * Head coordinates: x to the subject's left, y up, z out of the face, origin in the middle; metres.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/layout.h"

enum expression {
	EXPRESSION_JAW_OPEN,
	EXPRESSION_SMILE,
	EXPRESSION_STRETCH,
	EXPRESSION_PUCKER,
	EXPRESSION_LIP_DROP,
	EXPRESSION_SNARL,
	EXPRESSION_BLINK,
	EXPRESSION_BROW_L,
	EXPRESSION_BROW_R,
	EXPRESSION_FROWN,
	EXPRESSION_COUNT,
};

struct ellipsoid {
	struct vec3 centre_m, axes_m;
};

struct face_marker {
	struct vec3 normal; /* of the neutral face, unit */
	struct vec3
		shift_m[EXPRESSION_COUNT]; /* at weight 1; the jaw is a rotation, see jaw_share */
	double jaw_share;                  /* 0 = upper face, 1 = moves with the jaw bone */
	double reflectivity;               /* 1 = nominal */
	bool on_nose;
};

struct face {
	struct layout layout;                  /* names and neutral places */
	struct face_marker markers[LABEL_MAX]; /* in the layout's order */
	struct ellipsoid skull, nose;          /* what hides markers from cameras */
};

/* The shape and the marker placement vary a little with the seed. */
void face_init(struct face *face, uint64_t seed);

/* Place and unit normal of a marker; weights in [0, 1] by enum expression. */
struct vec3 face_marker_place(const struct face *face, uint32_t marker,
			      const double weights[EXPRESSION_COUNT], struct vec3 *normal);

/* True when the segment from `from` (on or above the skin) to `to` meets the skull or the nose. */
bool face_hides(const struct face *face, uint32_t marker, struct vec3 from, struct vec3 to);
