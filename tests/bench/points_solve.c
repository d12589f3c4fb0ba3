/*
 * Thread CPU per shot: the whole tracker on one face before eight cameras, and matching alone in a
 * room of six actors before twenty-four, with predictions and from nothing.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "base/sort.h"
#include "tests/bench/points.h"
#include "tests/bench/points_world.h"
#include "track/match/match.h"
#include "track/tracker.h"

#define PERIOD_NS 8333333
#define SETTLE_SHOTS 120
#define SHOTS 600
#define ROOM_SHOTS 100
#define FOUND_M 0.002
#define SAMPLES_MAX 100000

struct samples {
	int count;
	double us[SAMPLES_MAX];
};

static double thread_us(void)
{
	struct timespec t;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static void tell(struct points_bench *bench, const char *name, struct samples *samples,
		 double share)
{
	sort_doubles(samples->us, (size_t)samples->count);
	json_object_set_new(bench->figures, name,
			    json_real(samples->us[(int)(share * (samples->count - 1))]));
}

static void rig_of(const struct world *world, struct tracker_rig *rig)
{
	*rig = (struct tracker_rig){.camera_count = world->shape.camera_count,
				    .layout = &world->layout,
				    .settings = tracker_settings_default()};
	for (uint32_t c = 0; c < rig->camera_count; c++)
		rig->views[c] = &world->rig.views[c];
}

/* Labels right, of those that three cameras see. */
static void count_right(const struct world *world, const struct marker_set *set, long *right,
			long *seen)
{
	for (uint32_t m = 0; m < world->layout.marker_count; m++) {
		if (world->seen_by[0][m] < 3)
			continue;
		*seen += 1;
		*right += set->markers[m].status == MARKER_MEASURED &&
			  vec3_distance(set->markers[m].p_stage_m, world->truth_m[0][m]) < FOUND_M;
	}
}

/* A face of 150 markers before 8 cameras, all of the tracker. */
static void solve_face(uint64_t seed, struct samples *samples, long *right, long *seen)
{
	static const struct world_shape face = {8, 1, 150, {0.075, 0.11, 0.09}, 0.009, 0.2};
	static struct world world;
	static struct tracker_state state;
	static struct marker_set set;
	struct tracker_scratch *scratch;
	struct tracker_rig rig;
	struct shot shot;

	world_init(&world, &face, seed);
	rig_of(&world, &rig);
	tracker_state_init(&state, &world.layout);
	/* finding the head is not what is measured here */
	state.frames[0].tracked = true;
	state.frames[0].rt_stage_frame = world_head(&world, 0, 0);
	if (tracker_scratch_create(&scratch))
		exit(1);
	for (uint64_t n = 0; n < SETTLE_SHOTS + SHOTS; n++) {
		world_play(&world, n, (int64_t)(n + 1) * PERIOD_NS, &shot);
		double before_us = thread_us();
		tracker_run(&state, scratch, &rig, &shot, &set);
		if (n < SETTLE_SHOTS || samples->count == SAMPLES_MAX)
			continue;
		samples->us[samples->count++] = thread_us() - before_us;
		count_right(&world, &set, right, seen);
	}
	tracker_scratch_destroy(scratch);
	world_finish(&world);
}

/* Markers seen by three cameras with a point on them, and points where nothing is. */
static void count_found(const struct world *world, const struct matcher *m, long *found, long *seen,
			long *false_points)
{
	static bool used[POINT_MAX];

	for (uint32_t p = 0; p < m->point_count; p++)
		used[p] = false;
	for (uint32_t a = 0; a < world->shape.actor_count; a++)
		for (uint32_t k = 0; k < world->layout.marker_count; k++) {
			bool hit = false;

			for (uint32_t p = 0; p < m->point_count; p++)
				if (vec3_distance(m->points[p].fix.p_stage_m,
						  world->truth_m[a][k]) < FOUND_M)
					hit = used[p] = true;
			*seen += world->seen_by[a][k] >= 3;
			*found += world->seen_by[a][k] >= 3 && hit;
		}
	for (uint32_t p = 0; p < m->point_count; p++)
		*false_points += !used[p];
}

static int predict_all(const struct world *world, struct rng *rng, struct seed *seeds)
{
	int count = 0;

	for (uint32_t a = 0; a < world->shape.actor_count; a++)
		for (uint32_t k = 0; k < world->layout.marker_count; k++)
			seeds[count++] = (struct seed){
				vec3_add(world->truth_m[a][k], random_in_ball(rng, 0.001)), 0.002,
				LABEL_NONE, 0};
	return count;
}

struct room {
	struct samples predicted, cold;
	long found, seen, false_points;
};

static void match_room(struct points_bench *bench, struct room *room)
{
	static const struct world_shape shape = {24, 6, 96, {0.2, 0.4, 0.15}, 0.035, 1.5};
	static struct world world;
	static struct matcher matcher;
	static struct seed seeds[SEED_MAX];
	struct tracker_rig rig;
	struct shot shot;

	world_init(&world, &shape, bench->seed);
	rig_of(&world, &rig);
	for (uint64_t n = 0; n < ROOM_SHOTS; n++) {
		bool cold = n % 4 == 0;

		world_play(&world, n, (int64_t)(n + 1) * PERIOD_NS, &shot);
		int count = cold ? 0 : predict_all(&world, &world.rng, seeds);
		struct samples *samples = cold ? &room->cold : &room->predicted;
		double before_us = thread_us();
		match_begin(&matcher, &rig, &(struct view_excess){0}, &shot);
		match_prepare(&matcher, &rig, seeds, count);
		match_seeds(&matcher);
		match_leftovers(&matcher);
		samples->us[samples->count++] = thread_us() - before_us;
		count_found(&world, &matcher, &room->found, &room->seen, &room->false_points);
	}
	world_finish(&world);
}

void bench_solve(struct points_bench *bench)
{
	static struct samples samples;
	static struct room room;
	long right = 0, seen = 0;

	for (int r = 0; r < 1 + bench->effort / 2; r++)
		solve_face(bench->seed + (uint64_t)r, &samples, &right, &seen);
	tell(bench, "solve_cpu_us_p50", &samples, 0.5);
	tell(bench, "solve_cpu_us_p99", &samples, 0.99);
	json_object_set_new(bench->figures, "solve_right_share",
			    json_real((double)right / (double)seen));
	match_room(bench, &room);
	tell(bench, "match_room_us_p50", &room.predicted, 0.5);
	tell(bench, "match_room_us_p99", &room.predicted, 0.99);
	tell(bench, "match_room_cold_us_p99", &room.cold, 0.99);
	json_object_set_new(bench->figures, "match_room_found_share",
			    json_real((double)room.found / (double)room.seen));
	json_object_set_new(bench->figures, "match_room_false_points",
			    json_integer(room.false_points));
}
