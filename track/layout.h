/*
 * The markers that the actors wear, one actor after the other: names and neutral places in the
 * coordinates of the actor's own head (x to the subject's left, y up, z out of the face; metres).
 * A label is an index over all of them.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "track/observe.h"

#define NAME_BYTES 64 /* of a marker, group, camera or actor, with the NUL */
#define ACTOR_MAX HEAD_MAX
#define SEGMENT_MAX 9 /* of one body */

#define LEARNED_NEIGHBOUR_MAX 8
#define MPEG4_BYTES 6

struct layout_neighbour {
	int16_t marker;  /* counted from the actor's first */
	double spread_m; /* rms difference of the two displacements */
};

/* What the actor's calibration found out about a marker, over the whole range of motion. */
struct layout_learned {
	bool known;
	struct vec3 range_min_m, range_max_m; /* displacement from neutral, head axes */
	double speed_max_m_s;
	double rest_sd_m; /* per axis, of the face at rest */
	double cov_m2[6]; /* of the displacement: xx xy xz yy yz zz, head axes */
	int32_t neighbour_count;
	struct layout_neighbour neighbours[LEARNED_NEIGHBOUR_MAX]; /* most alike first */
};

struct layout_marker {
	char name[NAME_BYTES];
	char group[NAME_BYTES];
	char segment[NAME_BYTES]; /* of the body, which moves as one; empty: the head */
	bool rigid;               /* moves with the skull: head band, not skin */
	struct vec3 neutral_m;    /* of the body: in the neutral pose, the head looking ahead */
	double diameter_m;
	char mpeg4[MPEG4_BYTES]; /* feature point of ISO/IEC 14496-2, "8.1"; empty: none */
	struct layout_learned learned;
};

/* The markers first .. first + count are this actor's. */
struct layout_actor {
	char name[NAME_BYTES]; /* unique; empty when the only one has none */
	uint32_t first, count;
};

struct layout {
	uint32_t actor_count;
	struct layout_actor actors[ACTOR_MAX];
	uint32_t marker_count;
	struct layout_marker markers[LABEL_MAX];
};
