/*
 * Observations turned into what mrcal takes.
 */
#include "calib/solve/problem.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

static const mrcal_problem_constants_t CONSTANTS = {.point_min_range = 1e-3,
						    .point_max_range = 1e3};

#define ENTRIES_LENS_MAX 36 /* core, and cubic splines: 4 x 4 knots, twice */

static size_t take(size_t *at, size_t bytes)
{
	size_t start = *at;

	*at += (bytes + 15) & ~(size_t)15;
	return start;
}

static int map_block(struct problem *p)
{
	size_t at = 0, cameras = (size_t)p->camera_count;
	size_t corners = (size_t)p->view_count * (size_t)p->corner_count;

	p->residual_count = 2 * corners + cameras * (size_t)p->lens_count * 2 + 64;
	size_t intrinsics = take(&at, cameras * (size_t)p->lens_count * sizeof(double));
	size_t extrinsics = take(&at, cameras * sizeof(mrcal_pose_t));
	size_t frames = take(&at, (size_t)p->frame_count * sizeof(mrcal_pose_t));
	size_t warp = take(&at, sizeof(mrcal_calobject_warp_t));
	size_t pool = take(&at, corners * sizeof(mrcal_point3_t));
	size_t residuals = take(&at, p->residual_count * sizeof(double));
	size_t rms = take(&at, sizeof(double));
	char *block = mmap(NULL, at, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);

	if (block == MAP_FAILED)
		return -ENOMEM;
	p->block = block;
	p->block_bytes = at;
	p->intrinsics = (double *)(block + intrinsics);
	p->extrinsics = (mrcal_pose_t *)(block + extrinsics);
	p->frames = (mrcal_pose_t *)(block + frames);
	p->warp = (mrcal_calobject_warp_t *)(block + warp);
	p->pool = (mrcal_point3_t *)(block + pool);
	p->residuals = (double *)(block + residuals);
	p->rms_px = (double *)(block + rms);
	return 0;
}

/* Counts views and the frames that have some. */
static void count_views(struct problem *p, const struct observations *o, const bool *used)
{
	uint32_t pose = 0;

	for (uint32_t v = 0; v < o->view_count; v++) {
		if (used && !used[v])
			continue;
		p->frame_count += p->view_count == 0 || o->views[v].pose != pose;
		pose = o->views[v].pose;
		p->view_count++;
	}
}

static void fill_view(struct problem *p, const struct observations *o, int at, uint32_t view)
{
	mrcal_point3_t *pool = p->pool + (size_t)at * (size_t)p->corner_count;

	for (int i = 0; i < p->corner_count; i++) {
		const double *px = observations_px(o, view)[i];
		bool seen = !isnan(px[0] + px[1]);

		pool[i].x = seen ? px[0] : 0;
		pool[i].y = seen ? px[1] : 0;
		pool[i].z = seen ? 1 : -1;
	}
}

static void fill_views(struct problem *p, const struct observations *o, const bool *used)
{
	int at = 0, frame = -1;
	uint32_t nth = 0, last = UINT32_MAX;

	for (uint32_t v = 0; v < o->view_count; v++) {
		nth += v > 0 && o->views[v].pose != o->views[v - 1].pose;
		if (used && !used[v])
			continue;
		if (nth != last)
			p->nth_of[++frame] = last = nth;
		int camera = (int)o->views[v].camera;
		p->views[at] = (mrcal_observation_board_t){
			.icam = {.intrinsics = camera, .extrinsics = camera - 1}, .iframe = frame};
		p->view_of[at] = v;
		fill_view(p, o, at++, v);
	}
}

/* A seed has a focal length and a middle; the optimiser wants gradients. CAHVORE, which has them
 * from mrcal 2.4 on, could not be read back. */
static bool lens_can_be_solved(const mrcal_lensmodel_t *lens)
{
	mrcal_lensmodel_metadata_t meta = mrcal_lensmodel_metadata(lens);

	return meta.has_core && meta.has_gradients && lens->type != MRCAL_LENSMODEL_CAHVORE;
}

bool problem_find_lens(mrcal_lensmodel_t *lens, const char *name)
{
	return mrcal_lensmodel_from_name(lens, name) && lens_can_be_solved(lens);
}

int problem_init(struct problem *problem, const struct observations *observations, const bool *used,
		 const char *lens)
{
	struct problem made = {.camera_count = (int)observations->camera_count,
			       .width = board_corners_x(&observations->board),
			       .height = board_corners_y(&observations->board),
			       .corner_count = (int)observations->corner_count,
			       .square_m = observations->board.square_m};
	size_t cameras = observations->camera_count;

	if (!problem_find_lens(&made.lens, lens))
		return -EINVAL;
	made.lens_count = mrcal_lensmodel_num_params(&made.lens);
	count_views(&made, observations, used);
	made.views = calloc((size_t)made.view_count + 1, sizeof(*made.views));
	made.view_of = calloc((size_t)made.view_count + 1, sizeof(*made.view_of));
	made.nth_of = calloc((size_t)made.frame_count + 1, sizeof(*made.nth_of));
	made.sizes_px = calloc(cameras * 2, sizeof(*made.sizes_px));
	if (!made.views || !made.view_of || !made.nth_of || !made.sizes_px || map_block(&made)) {
		problem_finish(&made);
		return -ENOMEM;
	}
	for (size_t c = 0; c < cameras; c++) {
		made.sizes_px[2 * c] = observations->cameras[c].width_px;
		made.sizes_px[2 * c + 1] = observations->cameras[c].height_px;
	}
	fill_views(&made, observations, used);
	*problem = made;
	return 0;
}

void problem_finish(struct problem *problem)
{
	free(problem->views);
	free(problem->view_of);
	free(problem->nth_of);
	free(problem->sizes_px);
	if (problem->block)
		munmap(problem->block, problem->block_bytes);
	memset(problem, 0, sizeof(*problem));
}

/* Views of which some corner was used. */
static bool *mark_used(const struct solution *solution)
{
	bool *used = calloc(solution->view_count, sizeof(*used));

	for (size_t i = 0; used && i < (size_t)solution->view_count * solution->corner_count; i++)
		if (!isnan(solution->residual_px[i][0]))
			used[i / solution->corner_count] = true;
	return used;
}

int problem_init_solved(struct problem *problem, const struct observations *observations,
			const struct solution *solution)
{
	bool *used = mark_used(solution);
	int err = used ? problem_init(problem, observations, used, solution->lens) : -ENOMEM;

	free(used);
	if (!err)
		problem->selections = problem_last_selections(problem);
	return err;
}

void problem_set(struct problem *problem, const struct solution *solution)
{
	size_t cameras = solution->camera_count;

	memcpy(problem->intrinsics, solution->intrinsics,
	       cameras * solution->lens_count * sizeof(double));
	memcpy(problem->extrinsics, solution->rt_cam_ref + 1, (cameras - 1) * 6 * sizeof(double));
	problem->warp->x2 = solution->warp_m[0];
	problem->warp->y2 = solution->warp_m[1];
	for (int f = 0; f < problem->frame_count; f++)
		memcpy(&problem->frames[f], solution->rt_ref_board[problem->nth_of[f]],
		       6 * sizeof(double));
	for (int v = 0; v < problem->view_count; v++)
		for (int i = 0; i < problem->corner_count; i++) {
			size_t from = (size_t)problem->view_of[v] * solution->corner_count;

			if (isnan(solution->residual_px[from + (size_t)i][0]))
				problem->pool[v * problem->corner_count + i].z = -1;
		}
}

int problem_measurement_count(const struct problem *p)
{
	return mrcal_num_measurements(p->view_count, 0, p->width, p->height, p->camera_count,
				      p->camera_count - 1, p->frame_count, 0, 0, p->selections,
				      &p->lens);
}

int problem_state_count(const struct problem *p)
{
	return mrcal_num_states(p->camera_count, p->camera_count - 1, p->frame_count, 0, 0,
				p->view_count, p->selections, &p->lens);
}

mrcal_problem_selections_t problem_last_selections(const struct problem *p)
{
	bool splined = p->lens.type == MRCAL_LENSMODEL_SPLINED_STEREOGRAPHIC;

	return (mrcal_problem_selections_t){.do_optimize_intrinsics_core = !splined,
					    .do_optimize_intrinsics_distortions = true,
					    .do_optimize_extrinsics = true,
					    .do_optimize_frames = true,
					    .do_optimize_calobject_warp = true,
					    .do_apply_regularization = true,
					    .do_apply_outlier_rejection = true};
}

void problem_optimise(struct problem *p, mrcal_problem_selections_t selections)
{
	p->selections = selections;
	int bytes = problem_measurement_count(p) * (int)sizeof(double);
	mrcal_stats_t stats = mrcal_optimize(
		NULL, 0, p->residuals, bytes, p->intrinsics, p->extrinsics, p->frames, NULL,
		p->warp, p->camera_count, p->camera_count - 1, p->frame_count, 0, 0, p->views, NULL,
		p->view_count, 0, p->pool, &p->lens, p->sizes_px, selections, &CONSTANTS,
		p->square_m, p->width, p->height, false, false);

	*p->rms_px = stats.rms_reproj_error__pixels;
}

int problem_evaluate(struct problem *p, double *packed, struct cholmod_sparse_struct *jt)
{
	int bytes = problem_measurement_count(p) * (int)sizeof(double);
	bool good = mrcal_optimizer_callback(
		packed, problem_state_count(p) * (int)sizeof(double), p->residuals, bytes, jt,
		p->intrinsics, p->extrinsics, p->frames, NULL, p->warp, p->camera_count,
		p->camera_count - 1, p->frame_count, 0, 0, p->views, NULL, p->view_count, 0,
		p->pool, &p->lens, p->sizes_px, p->selections, &CONSTANTS, p->square_m, p->width,
		p->height, false);

	return good ? 0 : -EDOM;
}

/* A corner's row has its lens, its camera's pose, the board's pose and the warp; of a splined lens
 * the knots around it. Regularisation has less in a row. */
int problem_entry_room(const struct problem *p)
{
	int lens = mrcal_num_intrinsics_optimization_params(p->selections, &p->lens);

	if (lens > ENTRIES_LENS_MAX)
		lens = ENTRIES_LENS_MAX;
	return problem_measurement_count(p) * (lens + 6 + 6 + 2);
}

/* Where every number is 1, the packed state is what 1 becomes. (The library's own function for it
 * takes other arguments in each release.) */
int problem_scales(struct problem *p, double *scales)
{
	for (int i = 0; i < p->camera_count * p->lens_count; i++)
		p->intrinsics[i] = 1;
	for (int i = 0; i < (p->camera_count - 1) * 6; i++)
		((double *)p->extrinsics)[i] = 1;
	for (int i = 0; i < p->frame_count * 6; i++)
		((double *)p->frames)[i] = 1;
	p->warp->x2 = p->warp->y2 = 1;
	int err = problem_evaluate(p, scales, NULL);
	for (int i = 0; !err && i < problem_state_count(p); i++)
		scales[i] = 1 / scales[i];
	return err;
}
