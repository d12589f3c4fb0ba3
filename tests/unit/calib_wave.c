/*
 * Poses that an operator would show, projected through the true lenses.
 */
#include "calib_wave.h"

#include "track/rigid.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CORNERS_MIN 12 /* of a view that is reported */

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2 * rng_uniform(rng) - 1);
}

/* Somewhere in the volume, facing the middle of the cameras, tilted by up to 45 degrees. */
static struct pose pose_board(const struct board *board, struct rng *rng)
{
	/* board axes in the stage for a board that faces the cameras (+y), x to their right */
	struct pose facing = {.r = {{-1, 0, 0}, {0, 0, -1}, {0, -1, 0}}};
	struct vec3 axis = {spread(rng, 0.75), spread(rng, 0.9), spread(rng, 0.8)};
	struct pose turn = pose_from_rotation_vector(axis);
	struct pose pose = pose_compose(&facing, &turn);
	struct vec3 middle = {-board->square_m * (board_corners_x(board) - 1) / 2,
			      -board->square_m * (board_corners_y(board) - 1) / 2, 0};
	struct vec3 place = {spread(rng, 0.32), spread(rng, 0.3), 1.2 + spread(rng, 0.28)};

	pose.t = vec3_add(place, pose_rotate(&pose, middle));
	return pose;
}

static bool in_image(const struct sim_camera *camera, const double px[2])
{
	return px[0] > 3 && px[1] > 3 && px[0] < camera->width_px - 4 &&
	       px[1] < camera->height_px - 4;
}

static void look(struct waved *waved, const struct wave *wave, uint32_t c, uint32_t pose,
		 struct rng *rng)
{
	struct observations *o = &waved->observations;
	const struct sim_camera *camera = &waved->cameras[c];
	const struct pose *rt = &waved->rt_stage_board[pose];
	struct vec3 normal = {rt->r[0][2], rt->r[1][2], rt->r[2][2]};
	double px[BOARD_CORNER_MAX][2];
	uint32_t seen = 0;

	if (vec3_dot(vec3_unit(vec3_sub(rt->t, camera->centre_stage_m)), normal) < 0.4)
		return;
	for (uint32_t i = 0; i < o->corner_count; i++) {
		double noise_x = wave->noise_px * rng_normal(rng);
		double noise_y = wave->noise_px * rng_normal(rng);
		bool lost = rng_uniform(rng) < wave->lost_part;
		struct vec3 on_board = board_corner_m(&wave->board, (int)i);
		on_board.y *= wave->stretch ? wave->stretch : 1;
		struct vec3 p = pose_apply(rt, on_board);

		if (!lost && sim_camera_project(camera, p, px[i]) && in_image(camera, px[i])) {
			px[i][0] += noise_x;
			px[i][1] += noise_y;
			seen++;
		} else {
			px[i][0] = px[i][1] = NAN;
		}
	}
	if (seen >= CORNERS_MIN)
		assert(!observations_add(o, c, pose, (const double(*)[2])px));
}

void wave_make(struct waved *waved, const struct wave *wave)
{
	struct observed_camera observed[SIM_DEVICE_MAX];
	struct board flat = wave->board;
	const struct sim_script script = {.placement = SIM_PLACEMENT_FACE,
					  .lens = SIM_LENS_OPENCV8,
					  .actor_count = 1,
					  .actors = {{.seat_m = {0, 0, 1.2}}}};
	struct rng rng, noise;

	memset(waved, 0, sizeof(*waved));
	waved->camera_count = wave->ir_count + wave->hd_count;
	sim_cameras_init(waved->cameras, wave->ir_count, &script, wave->seed);
	sim_hd_cameras_init(waved->cameras + wave->ir_count, wave->hd_count, &script, wave->seed);
	for (uint32_t c = 0; c < waved->camera_count; c++) {
		const struct sim_camera *camera = &waved->cameras[c];

		observed[c] = (struct observed_camera){.width_px = camera->width_px,
						       .height_px = camera->height_px};
		memcpy(observed[c].name, camera->name, sizeof(observed[c].name));
	}
	flat.warp_x_m = flat.warp_y_m = 0; /* that is for the solver to find */
	assert(!observations_init(&waved->observations, &flat, observed, waved->camera_count,
				  NULL));
	waved->rt_stage_board = calloc(wave->pose_count, sizeof(*waved->rt_stage_board));
	assert(waved->rt_stage_board);
	rng_init(&rng, wave->seed, 17);
	rng_init(&noise, wave->seed + (wave->noise_seed << 32), 18);
	for (uint32_t pose = 0; pose < wave->pose_count; pose++) {
		waved->rt_stage_board[pose] = pose_board(&wave->board, &rng);
		for (uint32_t c = 0; c < waved->camera_count; c++)
			look(waved, wave, c, pose, &noise);
	}
}

void wave_finish(struct waved *waved)
{
	observations_finish(&waved->observations);
	free(waved->rt_stage_board);
	memset(waved, 0, sizeof(*waved));
}

struct vec3 wave_volume_point(uint32_t index)
{
	return (struct vec3){0.1 * (index % 5) - 0.2, 0.1 * (index / 5 % 5) - 0.2,
			     1.0 + 0.1 * (index / 25)};
}

bool wave_triangulate(const struct waved *waved, const struct solution *solution,
		      uint32_t camera_mask, struct vec3 p_stage_m, struct vec3 *p_ref_m)
{
	struct vec3 start = pose_apply(&waved->cameras[0].rt_cam_stage, p_stage_m);
	double px[SIM_DEVICE_MAX][2];

	for (uint32_t c = 0; c < waved->camera_count; c++)
		if (!sim_camera_project(&waved->cameras[c], p_stage_m, px[c]) ||
		    !in_image(&waved->cameras[c], px[c]))
			camera_mask &= ~(1U << c);
	return !solution_triangulate(solution, camera_mask, (const double(*)[2])px, start, p_ref_m);
}

static double judge_centres(const struct waved *waved, const struct solution *solution)
{
	struct rigid_pair pairs[SIM_DEVICE_MAX];
	struct pose fit;
	double worst = 0;

	for (uint32_t c = 0; c < waved->camera_count; c++)
		pairs[c] = (struct rigid_pair){solution_centre_m(solution, c),
					       waved->cameras[c].centre_stage_m, 1};
	assert(!rigid_fit(pairs, (int)waved->camera_count, &fit));
	for (uint32_t c = 0; c < waved->camera_count; c++)
		worst = fmax(worst, rigid_error(&pairs[c], &fit));
	return worst;
}

static double judge_projection(const struct waved *waved, const struct solution *solution,
			       const struct pose *rt_stage_ref)
{
	struct pose rt_ref_stage = pose_inverse(rt_stage_ref);
	double sum = 0, px[2], true_px[2];
	int count = 0;

	for (uint32_t i = 0; i < WAVE_VOLUME_POINTS; i++)
		for (uint32_t c = 0; c < waved->camera_count; c++) {
			struct vec3 p = wave_volume_point(i);

			if (!sim_camera_project(&waved->cameras[c], p, true_px) ||
			    !in_image(&waved->cameras[c], true_px) ||
			    !solution_project(solution, c, pose_apply(&rt_ref_stage, p), px))
				continue;
			sum += pow(px[0] - true_px[0], 2) + pow(px[1] - true_px[1], 2);
			count++;
		}
	return sqrt(sum / count);
}

struct wave_errors wave_judge(const struct waved *waved, const struct solution *solution)
{
	struct wave_errors errors = {.camera_worst_mm = 1e3 * judge_centres(waved, solution)};
	struct rigid_pair all[WAVE_VOLUME_POINTS];
	struct pose fit;
	double sum = 0;
	int count = 0, pairs = 0;

	for (uint32_t i = 0; i < WAVE_VOLUME_POINTS; i++) {
		all[count] = (struct rigid_pair){.to = wave_volume_point(i), .weight = 1};
		count += wave_triangulate(waved, solution, UINT32_MAX, all[count].to,
					  &all[count].from);
	}
	assert(!rigid_fit(all, count, &fit));
	for (uint32_t i = 0; i < WAVE_VOLUME_POINTS; i++)
		for (uint32_t c = 0; c + 3 < waved->camera_count; c++) {
			struct rigid_pair pair = {.to = wave_volume_point(i), .weight = 1};

			if (!wave_triangulate(waved, solution, 1U << c | 1U << (c + 3), pair.to,
					      &pair.from))
				continue;
			sum += rigid_error(&pair, &fit);
			pairs++;
		}
	errors.volume_px = judge_projection(waved, solution, &fit);
	errors.triangulate_mm = 1e3 * sum / pairs;
	return errors;
}

static uint32_t cameras_at(const struct waved *waved, struct vec3 p_stage_m)
{
	uint32_t mask = 0;
	double px[2];

	for (uint32_t c = 0; c < waved->camera_count; c++)
		if (sim_camera_project(&waved->cameras[c], p_stage_m, px) &&
		    in_image(&waved->cameras[c], px))
			mask |= 1U << c;
	return mask;
}

void wave_volume(const struct waved *waved, const struct solution *solution, struct volume *volume,
		 struct vec3 off_m[VOLUME_POINT_MAX])
{
	struct rigid_pair pairs[WAVE_VOLUME_POINTS];
	uint32_t count = 0;
	struct pose fit;

	for (uint32_t i = 0; i < WAVE_VOLUME_POINTS; i++) {
		struct vec3 p = wave_volume_point(i);
		uint32_t mask = cameras_at(waved, p);

		if (!wave_triangulate(waved, solution, mask, p, &volume->p_ref_m[count]))
			continue;
		pairs[count] = (struct rigid_pair){p, volume->p_ref_m[count], 1};
		volume->camera_mask[count++] = mask;
	}
	volume->count = count;
	assert(!rigid_fit(pairs, (int)count, &fit));
	for (uint32_t i = 0; i < count; i++)
		off_m[i] = vec3_sub(pairs[i].to, pose_apply(&fit, pairs[i].from));
}

int wave_solve(const struct waved *waved, struct solution *solution, struct seed *seed)
{
	const struct solve_settings settings = SOLVE_SETTINGS_DEFAULT;
	int err = seed_make(seed, &waved->observations, NULL);

	if (!err)
		err = solve(solution, &waved->observations, seed, &settings, NULL);
	if (err)
		seed_finish(seed);
	return err;
}
