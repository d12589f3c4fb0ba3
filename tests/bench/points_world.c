/*
 * Blobs are the true projections with noise; some are lost, and some are there that are no marker.
 */
#include "tests/bench/points_world.h"

#include <stdio.h>
#include <string.h>

#define SIGMA_PX 0.03
#define LOST_SHARE 0.02
#define STRAY_COUNT 3     /* per camera and shot */
#define RIGID_EVERY 18    /* so many markers of an actor, one is of the rigid kind */
#define FACING_COSINE 0.3 /* of the marker's normal and the line of sight */
#define SMILE_M 0.004     /* how far skin moves */
#define WAVE_PER_M 25.0   /* how smoothly, over an actor of a head's size */

static struct vec3 scaled(struct vec3 a, struct vec3 b)
{
	return (struct vec3){a.x * b.x, a.y * b.y, a.z * b.z};
}

/* On the front of the ellipsoid, away from those there are; the spacing gives way when it is full.
 */
static void place_marker(struct world *world, double *spacing_m)
{
	struct layout *layout = &world->layout;
	struct layout_marker *marker = &layout->markers[layout->marker_count];

	for (int tries = 0;; tries++) {
		struct vec3 way = vec3_unit(random_in_ball(&world->rng, 1));
		bool is_free = true;

		way.z = fabs(way.z);
		marker->neutral_m = scaled(way, world->shape.radii_m);
		for (uint32_t k = 0; k < layout->marker_count; k++)
			is_free &= vec3_distance(marker->neutral_m, layout->markers[k].neutral_m) >
				   *spacing_m;
		if (is_free)
			break;
		if (tries % 300 == 299)
			*spacing_m *= 0.95;
	}
	snprintf(marker->name, NAME_BYTES, "m%u", layout->marker_count);
	marker->rigid = layout->marker_count % RIGID_EVERY == 0;
	marker->diameter_m = 0.003;
	layout->marker_count++;
}

static void place_actor(struct world *world, struct world_actor *actor)
{
	struct rng *rng = &world->rng;
	bool alone = world->shape.actor_count == 1;
	struct vec3 turn = {0, rng_uniform(rng) - 0.5, 0};

	actor->rt_stage_head = pose_from_rotation_vector(turn);
	if (!alone)
		actor->rt_stage_head.t = random_in_ball(rng, 0.6 * world->shape.ball_m);
	actor->phase_rad = 6 * rng_uniform(rng);
}

void world_init(struct world *world, const struct world_shape *shape, uint64_t seed)
{
	double spacing_m = shape->spacing_m;

	memset(world, 0, sizeof(*world));
	world->shape = *shape;
	rng_init(&world->rng, seed, 50);
	random_rig_init(&world->rig, &world->rng, shape->camera_count, shape->ball_m);
	while (world->layout.marker_count < shape->marker_count)
		place_marker(world, &spacing_m);
	world->layout.actor_count = 1;
	world->layout.actors[0].count = world->layout.marker_count;
	for (uint32_t a = 0; a < shape->actor_count; a++)
		place_actor(world, &world->actors[a]);
}

void world_finish(struct world *world)
{
	random_rig_finish(&world->rig);
}

struct pose world_head(const struct world *world, uint32_t index, double time_s)
{
	const struct world_actor *actor = &world->actors[index];
	double a = actor->phase_rad + 2 * time_s;
	struct vec3 turn = {0.1 * sin(1.7 * a), 0.25 * sin(a), 0.08 * cos(1.3 * a)};
	struct pose moved = pose_from_rotation_vector(turn);

	moved.t = (struct vec3){0.04 * sin(0.9 * a), 0.02 * cos(1.1 * a), 0.03 * sin(a)};
	return pose_compose(&actor->rt_stage_head, &moved);
}

static struct vec3 skin_at(const struct world *world, const struct layout_marker *marker,
			   double time_s)
{
	double wave = WAVE_PER_M * 0.1 / world->shape.radii_m.y;
	double smile_m = SMILE_M * fmin(1, time_s); /* neutral at first */
	struct vec3 p = marker->neutral_m;

	if (marker->rigid)
		return p;
	return vec3_add(p, (struct vec3){smile_m * sin(9 * time_s + wave * p.x),
					 smile_m * sin(11 * time_s + wave * p.y),
					 smile_m * sin(7 * time_s + wave * (p.x + p.y))});
}

static void add_blob(struct blob_set *set, double x_px, double y_px)
{
	if (set->blob_count < BLOB_MAX)
		set->blobs[set->blob_count++] = (struct blob){.x_px = (float)x_px,
							      .y_px = (float)y_px,
							      .sigma_px = (float)SIGMA_PX,
							      .area_px2 = 12,
							      .peak = 120};
}

/* Whether camera c has a blob of the marker at p. */
static bool look_at(struct world *world, uint32_t c, struct vec3 p, struct vec3 normal)
{
	const struct rig_camera *camera = &world->rig.cameras[c];
	struct vec3 to_camera = vec3_unit(vec3_sub(world->rig.views[c].centre_stage_m, p));
	double pixel[2];

	if (vec3_dot(normal, to_camera) < FACING_COSINE || rng_uniform(&world->rng) < LOST_SHARE)
		return false;
	rig_camera_project(camera, p, pixel);
	if (!(pixel[0] > 0 && pixel[0] < RIG_WIDTH_PX - 1 && pixel[1] > 0 &&
	      pixel[1] < RIG_HEIGHT_PX - 1))
		return false;
	add_blob(&world->sets[c], pixel[0] + SIGMA_PX * rng_normal(&world->rng),
		 pixel[1] + SIGMA_PX * rng_normal(&world->rng));
	return true;
}

static void play_actor(struct world *world, uint32_t a, double time_s)
{
	struct pose head = world_head(world, a, time_s);
	struct vec3 radii = world->shape.radii_m;
	struct vec3 curved = {1 / (radii.x * radii.x), 1 / (radii.y * radii.y),
			      1 / (radii.z * radii.z)};

	for (uint32_t m = 0; m < world->layout.marker_count; m++) {
		const struct layout_marker *marker = &world->layout.markers[m];
		struct vec3 p = pose_apply(&head, skin_at(world, marker, time_s));
		struct vec3 normal =
			pose_rotate(&head, vec3_unit(scaled(marker->neutral_m, curved)));

		world->truth_m[a][m] = p;
		world->seen_by[a][m] = 0;
		for (uint32_t c = 0; c < world->shape.camera_count; c++)
			world->seen_by[a][m] += look_at(world, c, p, normal);
	}
}

void world_play(struct world *world, uint64_t number, int64_t time_ns, struct shot *shot)
{
	*shot = (struct shot){.number = number,
			      .mid_exposure_ns = time_ns,
			      .camera_count = world->shape.camera_count};
	for (uint32_t c = 0; c < shot->camera_count; c++) {
		world->sets[c].blob_count = 0;
		shot->sets[c] = &world->sets[c];
	}
	for (uint32_t a = 0; a < world->shape.actor_count; a++)
		play_actor(world, a, (double)time_ns * 1e-9);
	for (uint32_t c = 0; c < shot->camera_count; c++)
		for (int i = 0; i < STRAY_COUNT; i++)
			add_blob(&world->sets[c], RIG_WIDTH_PX * rng_uniform(&world->rng),
				 RIG_HEIGHT_PX * rng_uniform(&world->rng));
}
