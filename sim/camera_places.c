/*
 * Where cameras stand. One seated face: IR cameras on an arc 1.3 m away, as a face-capture stage
 * has. A room: IR cameras with four-megapixel sensors along its walls, high and low in turn.
 */
#include <stdio.h>
#include <string.h>

#include "sim/cameras.h"

#define RAD (M_PI / 180.0)

#define FACE_FOCAL_PX 1600 /* 7.7 mm on pixels of 4.8 um */
#define FACE_APERTURE_M 2.7e-3

/* 16 mm at f/4 on 2048 x 2048 pixels of 5 um: 36 degrees; 3.2 mm at 3.7 m are 2.8 px across. */
#define ROOM_SIDE_PX 2048
#define ROOM_FOCAL_PX 3200
#define ROOM_APERTURE_M 4e-3
#define ROOM_LENGTH_M 7.0
#define ROOM_WIDTH_M 6.4

#define HD_FOCAL_PX 2300
#define HD_APERTURE_M 1e-3 /* stopped down: the markers must not drown the skin */

static const struct vec3 SEAT_M = {0, 0, 1.2}; /* of the actor of a script without one */

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

/* Looks from `centre` at `aim`; camera axes: x right, y down, z forward; then rolled about z. */
static struct pose look_at(struct vec3 centre, struct vec3 aim, double roll_rad)
{
	struct vec3 forward = vec3_unit(vec3_sub(aim, centre));
	struct vec3 right = vec3_unit(vec3_cross(forward, (struct vec3){0, 0, 1}));
	struct vec3 down = vec3_cross(forward, right);
	struct pose upright = {.r = {{right.x, right.y, right.z},
				     {down.x, down.y, down.z},
				     {forward.x, forward.y, forward.z}}};
	struct pose roll = pose_from_rotation_vector((struct vec3){0, 0, roll_rad});
	struct pose rt_cam_stage = pose_compose(&roll, &upright);

	rt_cam_stage.t = vec3_scale(pose_rotate(&rt_cam_stage, centre), -1.0);
	return rt_cam_stage;
}

static struct sim_camera camera_of(const char *kind, uint32_t number, int width_px, int height_px,
				   double aperture_m)
{
	struct sim_camera camera = {
		.width_px = width_px, .height_px = height_px, .aperture_m = aperture_m};

	snprintf(camera.name, sizeof(camera.name), "%s%u", kind, number);
	return camera;
}

/* A seat, the origin of an actor who looks along +y before he is turned. */
static struct pose rt_stage_seat(const struct sim_script *script, uint32_t actor)
{
	double turn = actor < script->actor_count ? script->actors[actor].facing_deg : 0;
	struct pose seat = pose_from_rotation_vector((struct vec3){0, 0, turn * RAD});

	seat.t = actor < script->actor_count ? script->actors[actor].seat_m : SEAT_M;
	return seat;
}

/* In front of a seat, turned by `azimuth` to the actor's left. */
static void stand_before(struct sim_camera *camera, const struct pose *seat, double azimuth,
			 double away_m, double rise_m)
{
	struct vec3 place = {-away_m * sin(azimuth), away_m * cos(azimuth), rise_m};

	camera->centre_stage_m = pose_apply(seat, place);
	camera->range_m = vec3_distance(camera->centre_stage_m, seat->t);
}

static void place_on_arc(struct sim_camera *cameras, uint32_t count,
			 const struct sim_script *script, struct rng *rng)
{
	struct pose seat = rt_stage_seat(script, 0);
	double half_arc_deg = count <= 4 ? 40 : 55;

	for (uint32_t c = 0; c < count; c++) {
		struct sim_camera *camera = &cameras[c];
		double azimuth =
			RAD * (half_arc_deg * (2.0 * c / (count - 1) - 1.0) + spread(rng, 2));
		double rise_m = (c % 2 ? 0.20 : -0.25) + spread(rng, 0.05);
		double away_m = 1.30 + spread(rng, 0.12);
		struct vec3 aim = {spread(rng, 0.01), spread(rng, 0.01), spread(rng, 0.01)};

		*camera = camera_of("ir", c, 1280, 1024, FACE_APERTURE_M);
		stand_before(camera, &seat, azimuth, away_m, rise_m);
		camera->rt_cam_stage = look_at(camera->centre_stage_m, vec3_add(aim, seat.t),
					       spread(rng, 4 * RAD));
		sim_camera_set_lens(camera, script->lens, FACE_FOCAL_PX, rng);
	}
}

static struct vec3 middle_of_seats(const struct sim_script *script)
{
	struct vec3 sum = {0, 0, 0};

	for (uint32_t a = 0; a < script->actor_count; a++)
		sum = vec3_add(sum, script->actors[a].seat_m);
	return script->actor_count ? vec3_scale(sum, 1.0 / script->actor_count) : SEAT_M;
}

/* A point of the walls, `share` of the way around the room, from its middle. */
static struct vec3 wall_place(double share)
{
	double along = 2 * (ROOM_LENGTH_M + ROOM_WIDTH_M) * (share - floor(share));
	double half_length = 0.5 * ROOM_LENGTH_M, half_width = 0.5 * ROOM_WIDTH_M;

	if (along < ROOM_LENGTH_M)
		return (struct vec3){along - half_length, -half_width, 0};
	along -= ROOM_LENGTH_M;
	if (along < ROOM_WIDTH_M)
		return (struct vec3){half_length, along - half_width, 0};
	along -= ROOM_WIDTH_M;
	if (along < ROOM_LENGTH_M)
		return (struct vec3){half_length - along, half_width, 0};
	return (struct vec3){-half_length, half_width - (along - ROOM_LENGTH_M), 0};
}

static void place_in_room(struct sim_camera *cameras, uint32_t count,
			  const struct sim_script *script, struct rng *rng)
{
	struct vec3 middle = middle_of_seats(script);

	for (uint32_t c = 0; c < count; c++) {
		struct sim_camera *camera = &cameras[c];
		struct vec3 place = wall_place((c + 0.5 + spread(rng, 0.15)) / count);
		struct vec3 aim = {spread(rng, 0.15), spread(rng, 0.15), spread(rng, 0.1)};

		place.z = (c % 2 ? 1.1 : -0.1) + spread(rng, 0.2);
		*camera = camera_of("ir", c, ROOM_SIDE_PX, ROOM_SIDE_PX, ROOM_APERTURE_M);
		camera->centre_stage_m = vec3_add(middle, place);
		camera->range_m = vec3_norm(place);
		camera->rt_cam_stage = look_at(camera->centre_stage_m, vec3_add(middle, aim),
					       spread(rng, 4 * RAD));
		sim_camera_set_lens(camera, script->lens, ROOM_FOCAL_PX, rng);
	}
}

void sim_cameras_init(struct sim_camera *cameras, uint32_t count, const struct sim_script *script,
		      uint64_t seed)
{
	struct rng rng;

	rng_init(&rng, seed, 3);
	if (script->placement == SIM_PLACEMENT_ROOM)
		place_in_room(cameras, count, script, &rng);
	else
		place_on_arc(cameras, count, script, &rng);
}

void sim_hd_cameras_init(struct sim_camera *cameras, uint32_t count,
			 const struct sim_script *script, uint64_t seed)
{
	static const double azimuth_deg[SIM_HD_MAX] = {0, -32, 32};
	bool in_room = script->placement == SIM_PLACEMENT_ROOM && script->actor_count > 0;
	struct rng rng;

	rng_init(&rng, seed, 4);
	for (uint32_t c = 0; c < count; c++) {
		struct sim_camera *camera = &cameras[c];
		struct pose seat = rt_stage_seat(script, in_room ? c % script->actor_count : 0);
		double azimuth = RAD * (azimuth_deg[c] + spread(&rng, 2));

		*camera = camera_of("hd", c, 1920, 1080, HD_APERTURE_M);
		stand_before(camera, &seat, azimuth, 1.35 + spread(&rng, 0.05), spread(&rng, 0.03));
		camera->rt_cam_stage =
			look_at(camera->centre_stage_m, seat.t, spread(&rng, 1 * RAD));
		sim_camera_set_lens(camera, script->lens, HD_FOCAL_PX, &rng);
	}
}
