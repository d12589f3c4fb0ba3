/*
 * What a scene file says, as plain numbers: who sits or stands where, how it moves, what happens
 * when, what the cameras are like and what they do wrong. sim/world/scene.h makes a truth of it.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "config/sim_faults.h"
#include "track/layout.h"

#define SIM_ACTOR_MAX 6
#define SIM_EVENT_MAX 64
#define SIM_TITLE_BYTES 128
#define SIM_COMMENT_BYTES 1024

enum sim_performance {
	SIM_STILL,           /* neutral, head and face still */
	SIM_TALKING,         /* speech and mimic, small head motion */
	SIM_TURNING,         /* talking, and the head turns slowly by 60 degrees to each side */
	SIM_SHAKING,         /* talking, and the head shakes fast */
	SIM_RANGE_OF_MOTION, /* the 64 poses of an actor calibration, one after the other */
};

enum sim_placement {
	SIM_PLACEMENT_FACE, /* an arc about one seated face, 1.3 m away */
	SIM_PLACEMENT_ROOM, /* all around a room in which several actors stand */
};

enum sim_lens { SIM_LENS_OPENCV8, SIM_LENS_SPLINED };

/* Two renderers with unlike models of spot and noise; every figure is reported for both. */
enum sim_optics {
	SIM_OPTICS_GAUSSIAN, /* integrated Gaussian blur; photon and read noise */
	SIM_OPTICS_TAILED,   /* a point spread with wide tails; also fixed patterns and row noise */
};

struct sim_actor_script {
	char name[NAME_BYTES];
	int face_markers;       /* 0, 35, 70 or 182 */
	int body_markers;       /* 0 or 22: shoulders, chest, back and arms, 9 to 14 mm */
	double face_diameter_m; /* 0: 1.5 mm, or 3.2 mm of 182 */
	bool hemispheres;       /* markers stand out of the skin instead of lying on it */
	struct vec3 seat_m;     /* of the head's middle, stage coordinates */
	double facing_deg;      /* 0 = along +y; counter-clockwise seen from above */
	int performance;        /* enum sim_performance */
	double face_speed_m_s;  /* peak of the fastest marker, in head coordinates; default 0.4 */
	double shake_speed_m_s; /* peak of the face by the head's shakes alone; default 0.3 */
	double neutral_start_s, neutral_end_s; /* the take's clean neutrals; 0 = none at all */
	double reapplied_m; /* SD per axis of where the markers are today and the layout is not */
	bool ghosts_teeth, ghosts_eyes; /* specular spots at consistent places */
	int line, column;               /* in the file, for messages */
};

enum sim_event_kind {
	SIM_EVENT_EXPRESSION, /* holds `what` at weight `amount` */
	SIM_EVENT_FALL_OFF,   /* marker `what` is gone from then on, or for the time */
	SIM_EVENT_HAND,       /* a hand passes over the face */
	SIM_EVENT_PASSER,     /* somebody passes between the face and the cameras */
	SIM_EVENT_JIG_SLIP,   /* the head band slips by `amount` mm on the skull */
	SIM_EVENT_TURN,       /* the head turns to `amount` degrees and back */
	SIM_EVENT_MICRO,      /* marker group `what` moves by `amount` mm, there and back */
};

struct sim_event {
	int kind; /* enum sim_event_kind */
	char actor[NAME_BYTES];
	char what[NAME_BYTES]; /* an expression, marker or group */
	double at_s, for_s;    /* scene time */
	double amount;
	int line, column; /* in the file, for messages */
};

struct sim_script {
	char name[NAME_BYTES]; /* "rest", "04-shake" */
	char title[SIM_TITLE_BYTES];
	char comment[SIM_COMMENT_BYTES]; /* what to look at; may be empty */
	double seconds;                  /* how long it is worth playing */
	double rate_hz;
	uint32_t camera_count, hd_camera_count;
	int placement, lens, optics; /* enums above */
	bool ring_lights;            /* of the HD cameras, seen by the IR ones */
	bool cross_strobes;          /* IR cameras see each other's strobes */
	double ambient_grey;         /* of the IR images, above the black level */
	double hd_row_us;            /* rolling shutter of the HD cameras; 0 = global */
	bool board;                  /* a calibration board is waved instead of actors */
	uint32_t actor_count;
	struct sim_actor_script actors[SIM_ACTOR_MAX];
	uint32_t event_count;
	struct sim_event events[SIM_EVENT_MAX];
	struct sim_faults faults;
};
