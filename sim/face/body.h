/*
 * An upper body in rigid segments, with markers of 9 to 14 mm and what it hides. All places are in
 * the actor's head coordinates in the neutral pose: seated, looking ahead, forearms forward.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/rng.h"
#include "sim/face/sines.h"
#include "track/layout.h"

#define BODY_MARKER_COUNT 22

enum body_segment {
	SEGMENT_TORSO,
	SEGMENT_UPPER_ARM_L,
	SEGMENT_UPPER_ARM_R,
	SEGMENT_FOREARM_L,
	SEGMENT_FOREARM_R,
	SEGMENT_COUNT,
};

struct body_marker {
	struct layout_marker wanted;
	enum body_segment segment;
	struct vec3 neutral_m, normal;
	double reflectivity;
};

/* The flesh of a segment, an ellipsoid. */
struct body_flesh {
	struct pose rt_neutral_flesh;
	struct vec3 axes_m;
};

struct body {
	bool still;
	struct body_marker markers[BODY_MARKER_COUNT];
	struct body_flesh flesh[SEGMENT_COUNT];
	struct vec3 joints_m[SEGMENT_COUNT]; /* where each hangs on the one before */
	struct signal bends[SEGMENT_COUNT][3];
};

/* `reapplied_m`: as of a face. */
void body_init(struct body *body, bool still, double reapplied_m, uint64_t seed);

/* Where each segment is now: from neutral head coordinates to the stage, the neck being there. */
void body_pose(const struct body *body, const struct pose *rt_stage_neck, double time_s,
	       struct pose rt_stage_neutral[SEGMENT_COUNT]);

extern const char *const BODY_SEGMENT_NAMES[SEGMENT_COUNT];
