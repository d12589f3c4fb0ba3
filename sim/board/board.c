/*
 * The board's path and its corners.
 */
#include "sim/board/board.h"

#include <string.h>

#include "base/rng.h"
#include "sim/face/script.h"

#define RAD (M_PI / 180.0)
#define WARP_M 0.7e-3
#define GRAZING 0.12 /* cosine below which nothing can be read */
#define ROLLING_STEPS 6
#define REACH 1.7

/* Largest excursions, x y z of the stage and of the board, before a face's cameras. */
static const double PLACE_M[3] = {0.26, 0.12, 0.19};
static const double TILT_DEG[3] = {38, 48, 40};

/* Enough pixels for a tag's cells at 1.3 m. */
#define FACE_BOARD \
	((struct board){.squares_x = 12, .squares_y = 9, .square_m = 0.035, .tag_part = 0.7})

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

static struct board_wave make_wave(struct rng *rng, double amplitude, double low_hz, double high_hz)
{
	struct board_wave wave;
	double sum = 0;

	for (int i = 0; i < BOARD_WAVES; i++) {
		wave.hz[i] = low_hz + (high_hz - low_hz) * (i + rng_uniform(rng)) / BOARD_WAVES;
		wave.phase_rad[i] = 2 * M_PI * rng_uniform(rng);
		wave.amplitude[i] = 0.5 + rng_uniform(rng);
		sum += wave.amplitude[i];
	}
	for (int i = 0; i < BOARD_WAVES; i++)
		wave.amplitude[i] *= amplitude / sum;
	return wave;
}

static double wave_at(const struct board_wave *wave, double time_s)
{
	double value = 0;

	for (int i = 0; i < BOARD_WAVES; i++)
		value += wave->amplitude[i] *
			 sin(2 * M_PI * wave->hz[i] * time_s + wave->phase_rad[i]);
	return value;
}

void sim_board_init(struct sim_board *board, int placement, uint64_t seed)
{
	bool room = placement == SIM_PLACEMENT_ROOM;
	double reach = room ? 2.5 : 1;
	struct rng rng;

	rng_init(&rng, seed, 12);
	memset(board, 0, sizeof(*board));
	board->print = room ? BOARD_DEFAULT : FACE_BOARD;
	board->print.warp_x_m = spread(&rng, WARP_M);
	board->print.warp_y_m = spread(&rng, WARP_M);
	board->margin_m = 0.4 * board->print.square_m;
	board->middle_m = (struct vec3){0, 0, 1.2};
	board->spin_hz = room ? 0.05 : 0;
	for (int axis = 0; axis < 3; axis++) {
		board->place[axis] = make_wave(&rng, PLACE_M[axis] * reach, 0.06, 0.35);
		board->tilt[axis] = make_wave(&rng, TILT_DEG[axis] * RAD, 0.05, 0.3);
	}
}

void sim_board_reach(struct sim_board *board)
{
	for (int axis = 0; axis < 3; axis++)
		for (int i = 0; i < BOARD_WAVES; i++)
			board->place[axis].amplitude[i] *= REACH;
}

/* Upright, read from +y of the stage: x = -x, y = -z, z = -y. */
static const struct pose UPRIGHT = {.r = {{-1, 0, 0}, {0, 0, -1}, {0, -1, 0}}};

struct pose sim_board_pose(const struct sim_board *board, double time_s)
{
	double turn_rad = wave_at(&board->tilt[1], time_s) + 2 * M_PI * board->spin_hz * time_s;
	struct pose y = pose_from_rotation_vector((struct vec3){0, turn_rad, 0});
	struct pose x =
		pose_from_rotation_vector((struct vec3){wave_at(&board->tilt[0], time_s), 0, 0});
	struct pose z =
		pose_from_rotation_vector((struct vec3){0, 0, wave_at(&board->tilt[2], time_s)});
	struct pose yx = pose_compose(&y, &x);
	struct pose tilt = pose_compose(&yx, &z);
	struct pose rt_stage_board = pose_compose(&UPRIGHT, &tilt);

	struct vec3 middle = {0.5 * board->print.square_m * (board_corners_x(&board->print) - 1),
			      0.5 * board->print.square_m * (board_corners_y(&board->print) - 1),
			      0};
	struct vec3 wanted = {wave_at(&board->place[0], time_s), wave_at(&board->place[1], time_s),
			      wave_at(&board->place[2], time_s)};

	wanted = vec3_add(wanted, board->middle_m);
	rt_stage_board.t = vec3_sub(wanted, pose_rotate(&rt_stage_board, middle));
	return rt_stage_board;
}

bool sim_board_faces(const struct pose *rt_stage_board, const struct sim_camera *camera)
{
	struct vec3 away = {rt_stage_board->r[0][2], rt_stage_board->r[1][2],
			    rt_stage_board->r[2][2]};
	struct vec3 ray = vec3_sub(rt_stage_board->t, camera->centre_stage_m);

	return vec3_dot(away, ray) > GRAZING * vec3_norm(ray);
}

static bool is_inside(const struct sim_camera *camera, const double pixel[2])
{
	return pixel[0] >= -0.5 && pixel[1] >= -0.5 && pixel[0] <= camera->width_px - 0.5 &&
	       pixel[1] <= camera->height_px - 0.5;
}

/* With a rolling shutter the row says the time and the time the row; they settle at once. */
static struct sim_board_corner find_corner(const struct sim_board *board,
					   const struct sim_camera *camera,
					   const struct exposure *exposure, int index)
{
	double row = 0.5 * (camera->height_px - 1);
	struct sim_board_corner corner = {0};

	for (int step = 0; step < (exposure->row_s != 0 ? ROLLING_STEPS : 1); step++) {
		double time_s = exposure_of_row_s(exposure, row, camera->height_px);
		struct pose rt = sim_board_pose(board, time_s);

		if (!sim_camera_project(camera,
					pose_apply(&rt, board_corner_m(&board->print, index)),
					corner.pixel))
			return (struct sim_board_corner){0};
		row = corner.pixel[1];
		corner.seen = is_inside(camera, corner.pixel) && sim_board_faces(&rt, camera);
	}
	return corner;
}

void sim_board_corners(const struct sim_board *board, const struct sim_camera *camera,
		       const struct exposure *exposure, struct sim_board_corner *out)
{
	for (int i = 0; i < board_corner_count(&board->print); i++)
		out[i] = find_corner(board, camera, exposure, i);
}
