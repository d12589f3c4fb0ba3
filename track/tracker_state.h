/*
 * Everything the tracker carries from one shot to the next: flat, no pointers, the same bytes after
 * the same shots.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/geometry.h"
#include "track/layout.h"

#define NEIGHBOUR_MAX 8
#define WATCH_MAX 4
#define GHOST_MAX 96
#define LOOSE_MAX 768
#define PATTERN_MAX 16 /* of a face; the first is constant: where the markers are in the mean */
#define FRAME_MAX (ACTOR_MAX * (1 + SEGMENT_MAX)) /* heads and segments of bodies */

/* Another marker of the layout whose motion tells of this one's. */
struct neighbour {
	int16_t label;
	/* this one's displacement is the gain times the other's; both are learned */
	double gain;
	double leaves;          /* mean square of what that leaves, over that of what there was */
	double both_m2, its_m2; /* sums over time, fading: own times its, and its squared */
};

/* Where a marker was when it was last seen, or was taken as if it had been lost. */
struct last_sight {
	int64_t ns; /* 0 = never */
	bool moving;
	struct vec3 local_m, velocity_m_s, offset_m;
};

#define FILL_AGES 7 /* bins of the time since then */

enum label_kind {
	LABEL_SKIN,  /* moves with its neighbours */
	LABEL_SKULL, /* stiff against the head */
	LABEL_BODY,  /* nearly stiff against its segment */
};

struct label_state {
	/* from the layout */
	uint8_t kind; /* enum label_kind */
	int16_t actor;
	int16_t frame; /* what carries it; the actor's head is frame `actor` */
	int32_t neighbour_count;
	struct neighbour neighbours[NEIGHBOUR_MAX];
	double spacing_m; /* to the nearest other marker */
	double diameter_m;

	int16_t below;            /* of an upper lip or lid: the one across on the lower, or -1 */
	int16_t watch[WATCH_MAX]; /* the nearest others of its frame, or -1 */
	struct vec3 master_m;     /* where the layout has it */

	/* as worn today */
	struct vec3 base_m;  /* where it is in the neutral pose */
	uint32_t base_count; /* shots that told so; 0 = it is the layout's */
	double absent_s;     /* for how long it should have been seen and was not */

	struct vec3 jaw_m_rad; /* how it goes with the opening jaw; 0 = not at all */
	struct vec3 lean_m;    /* from there by the jaw, while the names about it are not known */

	/* where it rests, in the coordinates of its frame as all that follows: learned while the
	 * rigid markers hold the head, so that the skin can hold it when they are hidden */
	struct vec3 rest_m;
	double rest_variance_m2; /* mean square distance from there */
	double learned_s;        /* how long this one has been watched */

	/* tracked */
	bool confirmed;       /* the name is sure; only then is it given */
	bool doubted;         /* its last sight may have been another's: its neighbours place it */
	struct vec3 local_m;  /* where it was last seen */
	struct vec3 filled_m; /* where the last shot had it, seen or filled in */
	bool moving;          /* its velocity is known: it was seen twice in a row */
	struct vec3 velocity_m_s;
	double noise_m;         /* of that place, per axis, as triangulated */
	struct vec3 offset_m;   /* from where the neighbours told, when three cameras last saw it */
	double told_sigma_m;    /* ... and what they claimed */
	int64_t seen_ns;        /* when it was last measured; 0 = never */
	uint32_t camera_mask;   /* by which cameras */
	uint32_t outvoted_mask; /* ... and by which that were not used */
	double named_s;         /* how long it has had its name ... */
	double unbroken_s;      /* ... and been seen in every shot */
	int64_t steady_since_ns;   /* unconfirmed: explained without a break since; 0 = not */
	struct vec3 steady_from_m; /* where it was then ... */
	double steady_way_m;       /* ... and the farthest that it was from there */
	int32_t strange_count;     /* shots in a row in which it disagreed with its neighbours */

	/* what it is worth to fill this one in */
	struct last_sight last;
	float fill_over1[FILL_AGES]; /* its square error over what it claims, less one */
};

#define LOOK_SEES_LEAST 0.05f /* of the last shots: a camera that may see the marker still */

/* How a marker looks to each camera; apart from the rest, which is gone through all the time. */
struct label_look {
	uint8_t peak[CAMERA_MAX];       /* grey value when it was last alone; 0 = never */
	float shape_px2[CAMERA_MAX][3]; /* spread of its light then, xx xy yy; 0 = never */
	float sees[CAMERA_MAX]; /* in which share of the last shots with its name it saw it */
};

/* What moves as one: the head of an actor, or a segment of a body. */
struct frame_state {
	int16_t actor;
	uint16_t label_first, label_end; /* its labels lie in here, others too */
	uint16_t label_count;
	double carry_s; /* its motion is carried on this long */
	bool tracked;
	struct pose rt_stage_frame;
	struct vec3 velocity_m_s;    /* of the frame's origin, stage axes */
	struct vec3 turn_rate_rad_s; /* stage axes */
	int64_t seen_ns;             /* when it was last measured */
	int64_t held_ns;             /* ... by three rigid markers */
	uint32_t held_count;         /* rigid markers that held it last */
	uint32_t unheld_count;       /* shots in a row without three rigid markers */
	bool was_held;               /* three of them were seen since it was found */
	uint32_t acquire_cursor;     /* where the search for it goes on */
};

/* Of a head, what needs time to tell. */
struct face_state {
	double still_s;      /* neutral and still since */
	bool neutral_known;  /* the day's neutral was learned */
	double slipping_s;   /* for how long the skin seems to have moved as one ... */
	struct vec3 shift_m; /* ... and how far, smoothed; head axes */
	struct vec3 turn_rad;
	double slipped_m; /* how far the rigid markers have slipped in all */
};

/* A marker's share in the patterns of its face; sums over time, fading, in seconds. */
struct expression_row {
	float shift_mm[3][PATTERN_MAX]; /* per unit of each pattern; from the layout's place */
	float square[PATTERN_MAX][PATTERN_MAX], product[3][PATTERN_MAX];
	float off_mm2;   /* mean square of what the patterns leave, per axis */
	float worst_mm2; /* the same, when it was much */
	float learned_s;
};

struct expression_state {
	int32_t count;                                     /* of patterns */
	double amount[PATTERN_MAX], variance[PATTERN_MAX]; /* in the last shot that told */
	int64_t seen_ns;                                   /* when that was */
	double learned_s, since_learned_s, since_new_s;
	uint32_t turn; /* the row that is solved next */
};

/* A light that stands still and is no marker. */
struct ghost {
	int16_t frame; /* the head that it is on, or -1: the stage */
	bool seen_now;
	double seen_s;   /* for how long in all; 0 = the place is free */
	struct vec3 p_m; /* coordinates of the frame */
};

/* What the views disagree by beyond their blobs' sigmas: calibration, mostly. */
struct view_excess {
	double all_px2;
	double camera_px2[CAMERA_MAX]; /* of cameras that are off by themselves, on top */
};

/* What lens and focus add to the spread of a spot. */
struct view_blur {
	double px2[CAMERA_MAX];
	uint16_t sights[CAMERA_MAX]; /* that told so, as far as they are counted */
	uint32_t turn;
};

struct tracker_state {
	int64_t mid_exposure_ns; /* of the last shot; 0 before the first */
	int64_t period_ns;       /* last gap between shots */
	struct view_excess excess;
	uint32_t excess_turn;
	struct view_blur blur;
	uint32_t label_count;
	double diameter_min_m, diameter_max_m; /* of all that is worn */
	uint32_t actor_count;
	uint32_t frame_count; /* the actors' heads come first */
	uint32_t segment_turn;
	uint32_t acquire_turn; /* the lost head whose turn it is to be searched for */
	struct frame_state frames[FRAME_MAX];
	struct face_state faces[ACTOR_MAX];
	struct label_state labels[LABEL_MAX];
	struct label_look looks[LABEL_MAX];
	struct expression_state expressions[ACTOR_MAX];
	struct expression_row rows[LABEL_MAX];
	struct ghost ghosts[GHOST_MAX];
	uint32_t loose_count;
	struct vec3 loose_stage_m[LOOSE_MAX]; /* the unlabelled points of the last shot */
};
