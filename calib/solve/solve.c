/*
 * From the seed into mrcal's arguments, and what came out of them.
 */
#include "calib/solve/solve.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/sort.h"
#include "calib/rt.h"
#include "calib/solve/stages.h"

#define RMS_MAX_PX 1.5        /* more: these numbers describe nothing */
#define DISTORTION_START 1e-7 /* not quite none: with none, gradients cancel */

static int solution_init(struct solution *s, const struct observations *o, const struct seed *seed,
			 const struct problem *problem)
{
	size_t corners = (size_t)o->view_count * o->corner_count;

	*s = (struct solution){.lens_count = (uint32_t)problem->lens_count,
			       .camera_count = o->camera_count,
			       .pose_count = seed->pose_count,
			       .view_count = o->view_count,
			       .corner_count = o->corner_count};
	mrcal_lensmodel_name(s->lens, sizeof(s->lens), &problem->lens);
	s->intrinsics = calloc((size_t)o->camera_count * s->lens_count, sizeof(double));
	s->rt_cam_ref = calloc(o->camera_count, sizeof(*s->rt_cam_ref));
	s->rt_ref_board = calloc(seed->pose_count, sizeof(*s->rt_ref_board));
	s->residual_px = malloc(corners * sizeof(*s->residual_px));
	if (!s->intrinsics || !s->rt_cam_ref || !s->rt_ref_board || !s->residual_px) {
		solution_finish(s);
		return -ENOMEM;
	}
	for (uint32_t n = 0; n < seed->pose_count; n++)
		pose_to_rt(&seed->rt_ref_board[n], s->rt_ref_board[n]);
	for (size_t i = 0; i < corners; i++)
		s->residual_px[i][0] = s->residual_px[i][1] = NAN;
	return 0;
}

void solution_finish(struct solution *solution)
{
	free(solution->intrinsics);
	free(solution->rt_cam_ref);
	free(solution->rt_ref_board);
	free(solution->residual_px);
	memset(solution, 0, sizeof(*solution));
}

static void read_numbers(struct solution *s, const struct problem *p)
{
	memcpy(s->intrinsics, p->intrinsics,
	       s->camera_count * s->lens_count * sizeof(*s->intrinsics));
	memcpy(s->rt_cam_ref + 1, p->extrinsics, (s->camera_count - 1) * 6 * sizeof(double));
	for (int f = 0; f < p->frame_count; f++)
		memcpy(s->rt_ref_board[p->nth_of[f]], &p->frames[f], 6 * sizeof(double));
	s->warp_m[0] = p->warp->x2;
	s->warp_m[1] = p->warp->y2;
}

/* The library's own rms counts corners that were not seen; this one does not. */
static void read_residuals(struct solution *s, const struct problem *p,
			   const struct observations *o)
{
	double sum[CAMERA_MAX] = {0}, all = 0;
	uint32_t count[CAMERA_MAX] = {0};

	for (int v = 0; v < p->view_count; v++)
		for (int i = 0; i < p->corner_count; i++) {
			size_t at = (size_t)v * (size_t)p->corner_count + (size_t)i;
			size_t to = (size_t)p->view_of[v] * s->corner_count + (size_t)i;
			uint32_t camera = o->views[p->view_of[v]].camera;

			if (p->pool[at].z < 0) {
				s->outlier_count += !isnan(o->px[to][0] + o->px[to][1]);
				continue;
			}
			const double *x = p->residuals + 2 * at;
			memcpy(s->residual_px[to], x, sizeof(s->residual_px[to]));
			sum[camera] += x[0] * x[0] + x[1] * x[1];
			count[camera]++;
		}
	for (uint32_t c = 0; c < s->camera_count; c++) {
		s->rms_camera_px[c] = count[c] ? sqrt(sum[c] / count[c]) : 0;
		s->used_count += count[c];
		all += sum[c];
	}
	double freedom = 2.0 * s->used_count - problem_state_count(p);
	s->mrcal_rms_px = *p->rms_px;
	s->rms_px = sqrt(all / fmax(s->used_count, 1));
	s->sigma_px = sqrt(all / fmax(freedom, 1));
}

/* Pixels are square; where all cameras say otherwise, the print is not. */
static double median_aspect(const struct solution *s)
{
	double aspects[CAMERA_MAX];

	for (uint32_t c = 0; c < s->camera_count; c++)
		aspects[c] =
			s->intrinsics[c * s->lens_count + 1] / s->intrinsics[c * s->lens_count];
	sort_doubles(aspects, s->camera_count);
	return aspects[s->camera_count / 2];
}

static void complain_of_rms(const struct solution *s, const struct observations *o,
			    struct diag *diag)
{
	uint32_t worst = 0;

	for (uint32_t c = 1; c < s->camera_count; c++)
		if (s->rms_camera_px[c] > s->rms_camera_px[worst])
			worst = c;
	diag_add(diag,
		 "the cameras do not agree on the board: corners are off by %.1f px rms (camera "
		 "%s: %.1f px); check the numbers of squares, that nothing moved but the board, "
		 "and that cameras exposed together",
		 s->rms_px, o->cameras[worst].name, s->rms_camera_px[worst]);
}

static int judge(const struct solution *s, const struct observations *o, const struct seed *seed,
		 struct diag *diag)
{
	bool agree = s->rms_px < RMS_MAX_PX;
	double aspect = median_aspect(s);
	bool stretched = fabs(aspect - 1) > SEED_ASPECT_TOLERANCE;

	if (agree && !stretched)
		return 0;
	if (!agree)
		complain_of_rms(s, o, diag);
	if (!stretched)
		aspect = seed->board_aspect;
	if (fabs(aspect - 1) > SEED_ASPECT_TOLERANCE)
		diag_add(diag,
			 "the board's squares look %.4f times as high as wide: was it printed "
			 "with \"fit to page\"? measure its rulers and print it again to scale",
			 aspect);
	return -EINVAL;
}

int solution_read(struct solution *solution, struct problem *problem,
		  const struct observations *observations, const struct seed *seed)
{
	struct solution made;
	int err = solution_init(&made, observations, seed, problem);

	if (err)
		return err;
	problem->selections = problem_last_selections(problem);
	read_numbers(&made, problem);
	read_residuals(&made, problem, observations);
	*solution = made;
	return 0;
}

static void set_seed(struct problem *p, const struct observations *o, const struct seed *seed)
{
	for (int c = 0; c < p->camera_count; c++) {
		double *lens = p->intrinsics + c * p->lens_count;

		lens[0] = lens[1] = seed->focal_px[c];
		lens[2] = (o->cameras[c].width_px - 1) / 2.0;
		lens[3] = (o->cameras[c].height_px - 1) / 2.0;
		for (int i = 4; i < p->lens_count; i++)
			lens[i] = DISTORTION_START;
		if (c > 0)
			pose_to_rt(&seed->rt_cam_ref[c], (double *)&p->extrinsics[c - 1]);
	}
	for (int f = 0; f < p->frame_count; f++)
		pose_to_rt(&seed->rt_ref_board[p->nth_of[f]], (double *)&p->frames[f]);
}

int solve_check_lens(const char *name, struct diag *diag)
{
	mrcal_lensmodel_t lens;

	if (problem_find_lens(&lens, name))
		return 0;
	diag_add(diag,
		 "lens %s: not a lens model that mrcal knows and can solve for; "
		 "take " SOLVE_LENS_DEFAULT,
		 name);
	return -EINVAL;
}

int solve(struct solution *solution, const struct observations *observations,
	  const struct seed *seed, const struct solve_settings *settings, struct diag *diag)
{
	struct solution made;
	struct problem problem;
	pid_t child;
	int err = solve_check_lens(settings->lens, diag);

	if (!err)
		err = problem_init(&problem, observations, seed->good_view, settings->lens);
	if (err)
		return err;
	set_seed(&problem, observations, seed);
	err = stages_start(&child, &problem, STAGES_ALL, settings->seconds_max);
	if (!err)
		err = stages_wait(child, &problem, settings->seconds_max, diag);
	if (!err)
		err = solution_read(&made, &problem, observations, seed);
	problem_finish(&problem);
	if (err)
		return err;
	err = judge(&made, observations, seed, diag);
	if (err)
		solution_finish(&made);
	else
		*solution = made;
	return err;
}
