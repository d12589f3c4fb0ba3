/*
 * The truth: actors with moving heads, talking faces and bodies, and the cameras around them, as a
 * pure function of scene time. Renderers and truth files ask it; the tracker never sees it.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "base/geometry.h"
#include "config/board.h"
#include "sim/face/body.h"
#include "sim/face/script.h"
#include "track/layout.h"
#include "track/observe.h"

struct sim_scene; /* immutable once made: any thread may read it */

struct sim_options {
	const char *scene;               /* a name, or a file's path; NULL or "" = talking */
	uint64_t seed;                   /* of face shape, motion and noise */
	uint32_t camera_count;           /* of IR cameras; 0 = the scene's own; 4 to 24 */
	double rate_hz;                  /* 0 = the scene's own */
	const char *optics;              /* "gaussian", "tailed"; NULL = the scene's own */
	double face_speed_m_s;           /* of all its actors; 0 = the scene's own; up to 3 */
	const struct sim_faults *faults; /* beside the scene's own; NULL = none */
	/* HD cameras expose in shots k with k % hd_divider == hd_phase, hd_after_ir_ns after the
	 * IR cameras (from mid-exposure to mid-exposure). */
	uint32_t hd_camera_count; /* 0 = the scene's own; up to 3 */
	uint32_t hd_divider;      /* 0 = 4 */
	uint32_t hd_phase;
	int64_t hd_after_ir_ns;
	int64_t hd_row_ns; /* rolling shutter: from row to row; 0 = the scene's own */
	bool board;        /* a calibration board is waved, instead of what the scene's actors do */
};

/* What the default trigger plan of a config makes hd_after_ir_ns. */
#define SIM_HD_AFTER_IR_NS INT64_C(1875000)

/* Returns 0, -EINVAL with a message in `diag`, or -ENOMEM. */
int sim_scene_create(struct sim_scene **out, const struct sim_options *options, struct diag *diag);
void sim_scene_destroy(struct sim_scene *scene); /* accepts NULL */

#define SIM_GHOST_MAX 48
#define SIM_OCCLUDER_MAX 64

struct sim_truth_marker {
	struct vec3 p_stage_m; /* centre of the disc on the skin, or of a hemisphere's base */
	struct vec3 normal_stage;
	uint32_t visible_mask; /* bit c: IR camera c sees it unobstructed */
	bool worn;             /* false: it fell off, and is nowhere */
	bool tucked;           /* in a fold of the skin or under a lid: nobody sees it */
};

struct sim_truth_actor {
	struct pose rt_stage_head; /* of the skull, wherever the head band has slipped to */
	/* of each body segment: takes its markers' neutral places to the stage */
	struct pose rt_stage_segment[SEGMENT_COUNT];
	double lips_parted_m;  /* the mouth's opening */
	double lids_closed[2]; /* 0 to 1; left, right */
};

/* A glossy bit of a tooth or an eye. A lamp beside the lens shows as a spot where the surface faces
 * the camera: for each camera on the line to about one place, the centre of the curvature. */
struct sim_truth_ghost {
	uint32_t actor;
	struct vec3 centre_stage_m; /* of curvature */
	struct vec3 axis_stage;     /* unit; the surface goes to some angle about it */
	double radius_m, cos_limit;
	double brightness;     /* 1 = a nominal face marker; 0 while lips or lids are closed */
	uint32_t visible_mask; /* as a marker's */
};

/* Hides what is behind it: u = to_unit * (p - centre) takes it to the unit sphere. */
struct sim_truth_occluder {
	struct vec3 centre_stage_m;
	double to_unit[3][3];
	double radius_m; /* of a sphere around it */
};

struct sim_truth {
	double time_s;
	uint32_t actor_count;
	struct sim_truth_actor actors[SIM_ACTOR_MAX];
	uint32_t marker_count; /* the layout's, in its order */
	struct sim_truth_marker markers[LABEL_MAX];
	uint32_t ghost_count;
	struct sim_truth_ghost ghosts[SIM_GHOST_MAX];
	uint32_t occluder_count; /* heads, noses, bodies, hands, passers */
	struct sim_truth_occluder occluders[SIM_OCCLUDER_MAX];
};

/* The truth at scene time `time_s` >= 0. Any thread; does not allocate. */
void sim_scene_truth(const struct sim_scene *scene, double time_s, struct sim_truth *out);

uint32_t sim_scene_camera_count(const struct sim_scene *scene); /* of IR cameras */
uint32_t sim_scene_hd_count(const struct sim_scene *scene);

/* HD cameras are numbered behind the IR ones. */
const char *sim_scene_camera_name(const struct sim_scene *scene, uint32_t camera);
/* What it was made of, with the options' values in it. */
const struct sim_script *sim_scene_script(const struct sim_scene *scene);
/* That is waved before it while it is calibrated. */
const struct board *sim_scene_board(const struct sim_scene *scene);
const struct layout *sim_scene_layout(const struct sim_scene *scene);

/* Shot n is exposed around scene time (n + 0.5) * period; this is that middle, in nanoseconds. */
int64_t sim_scene_mid_exposure_ns(const struct sim_scene *scene, uint64_t shot);
int64_t sim_scene_period_ns(const struct sim_scene *scene);

/* HD frame k is exposed in shot hd_divider * k + hd_phase, at this time. */
uint64_t sim_scene_hd_shot(const struct sim_scene *scene, uint64_t k);
int64_t sim_scene_hd_mid_exposure_ns(const struct sim_scene *scene, uint64_t shot);

/*
 * Writes what a station needs to look at this scene: DIR/rig/NAME.cameramodel, DIR/layout.yaml (of
 * several actors: DIR/layout-ACTOR.yaml) and DIR/stage.yaml, whose cameras have the addresses given
 * (one per camera, HD last) and whose trigger and extra top-level YAML lines are as given (NULL =
 * none). No truth goes in. Returns 0 or a negative errno with a message.
 */
int sim_scene_write_stage(const struct sim_scene *scene, const char *dir,
			  const char *const *addresses, const char *extra_yaml, struct diag *diag);

/* Another config beside that, DIR/NAME, for the same rig and layouts. */
int sim_scene_write_config(const struct sim_scene *scene, const char *dir, const char *name,
			   const char *const *addresses, const char *extra_yaml, struct diag *diag);
