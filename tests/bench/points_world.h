/*
 * Something for the tracker to solve, made apart from sim/: actors whose markers lie on an
 * ellipsoid that sways, turns and deforms smoothly, before a random rig, at blob level.
 */
#pragma once

#include "tests/bench/points_rig.h"
#include "track/layout.h"

#define WORLD_ACTOR_MAX 6

struct world_shape {
	uint32_t camera_count, actor_count, marker_count; /* of each actor */
	struct vec3 radii_m;                              /* of an actor */
	double spacing_m;                                 /* of markers, at the least */
	double ball_m;                                    /* the actors are in it */
};

struct world_actor {
	struct pose rt_stage_head; /* at rest */
	double phase_rad;
};

struct world {
	struct world_shape shape;
	struct rng rng;
	struct random_rig rig;
	struct layout layout; /* of one actor; all wear the same */
	struct world_actor actors[WORLD_ACTOR_MAX];

	/* of the last shot */
	struct vec3 truth_m[WORLD_ACTOR_MAX][LABEL_MAX];
	uint8_t seen_by[WORLD_ACTOR_MAX][LABEL_MAX]; /* cameras that have a blob of it */
	struct blob_set sets[CAMERA_MAX];
};

/* Ends the program when there is no memory. */
void world_init(struct world *world, const struct world_shape *shape, uint64_t seed);
void world_finish(struct world *world);

/* Fills `shot` with what the cameras see at that time; the sets are the world's. */
void world_play(struct world *world, uint64_t number, int64_t time_ns, struct shot *shot);

/* The truth. */
struct pose world_head(const struct world *world, uint32_t actor, double time_s);
