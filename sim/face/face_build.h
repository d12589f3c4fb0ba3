/*
 * A face while it is made.
 */
#pragma once

#include "sim/face/face.h"
#include "sim/face/face_shape.h"

struct face_maker {
	struct face *face;
	const struct face_options *options;
	struct face_shape shape;
	struct rng rng;       /* shape and placement */
	struct rng today_rng; /* where the markers were put today */
};

void face_add_skin(struct face_maker *maker);
void face_add_band(struct face_maker *maker);

/* Lips meet when they are pressed; lids and the fold beside the mouth take markers in. */
void face_join_lips(struct face *face);
void face_set_tucks(struct face *face);

void face_add_teeth(struct face_maker *maker);
void face_add_eyes(struct face_maker *maker);
