/*
 * Two halves: every other pose.
 */
#include "calib/solve/cross_check.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calib/solve/stages.h"

struct half {
	struct problem problem;
	struct solution solution;
	pid_t child;
	bool started;
};

static bool *mark_half(const struct observations *o, const struct seed *seed, uint32_t which)
{
	bool *used = malloc(o->view_count * sizeof(*used));
	uint32_t nth = 0;

	if (!used)
		return NULL;
	for (uint32_t v = 0; v < o->view_count; v++) {
		nth += v > 0 && o->views[v].pose != o->views[v - 1].pose;
		used[v] = seed->good_view[v] && nth % 2 == which;
	}
	return used;
}

static int half_init(struct half *half, uint32_t which, const struct observations *o,
		     const struct seed *seed, const struct solution *from)
{
	bool *used = mark_half(o, seed, which);
	int err = used ? problem_init(&half->problem, o, used, from->lens) : -ENOMEM;

	free(used);
	if (!err)
		problem_set(&half->problem, from);
	return err;
}

static void half_finish(struct half *half)
{
	problem_finish(&half->problem);
	solution_finish(&half->solution);
}

/* Both at once, and both are waited for. */
static int run_halves(struct half halves[2], enum stages stages, double seconds_max,
		      struct diag *diag)
{
	int result = 0;

	for (int h = 0; h < 2; h++) {
		int err = stages_start(&halves[h].child, &halves[h].problem, stages, seconds_max);

		halves[h].started = !err;
		result = result ? result : err;
	}
	for (int h = 0; h < 2; h++) {
		if (!halves[h].started)
			continue;
		int err = stages_wait(halves[h].child, &halves[h].problem, seconds_max, diag);

		result = result ? result : err;
	}
	return result;
}

/* The cameras of each half for the poses of the other. */
static void swap_cameras(struct half halves[2])
{
	struct problem *a = &halves[0].problem, *b = &halves[1].problem;

	for (int i = 0; i < a->camera_count * a->lens_count; i++) {
		double kept = a->intrinsics[i];

		a->intrinsics[i] = b->intrinsics[i];
		b->intrinsics[i] = kept;
	}
	for (int c = 0; c + 1 < a->camera_count; c++) {
		mrcal_pose_t kept = a->extrinsics[c];

		a->extrinsics[c] = b->extrinsics[c];
		b->extrinsics[c] = kept;
	}
	mrcal_calobject_warp_t kept = *a->warp;
	*a->warp = *b->warp;
	*b->warp = kept;
}

static double rms_of(const struct half halves[2])
{
	double sum = 0, count = 0;

	for (int h = 0; h < 2; h++) {
		const struct problem *p = &halves[h].problem;

		for (int i = 0; i < p->view_count * p->corner_count; i++) {
			if (p->pool[i].z < 0)
				continue;
			sum += pow(p->residuals[2 * i], 2) + pow(p->residuals[2 * i + 1], 2);
			count++;
		}
	}
	return sqrt(sum / fmax(count, 1));
}

static int check_halves(struct half halves[2], struct cross_check *made,
			const struct observations *o, const struct seed *seed,
			const struct solution *solution, const struct volume *volume,
			const struct solve_settings *settings, struct diag *diag)
{
	int err = 0;

	for (uint32_t h = 0; !err && h < 2; h++)
		err = half_init(&halves[h], h, o, seed, solution);
	if (!err)
		err = run_halves(halves, STAGES_LAST, settings->seconds_max, diag);
	for (int h = 0; !err && h < 2; h++)
		err = solution_read(&halves[h].solution, &halves[h].problem, o, seed);
	if (err)
		return err;
	if (volume_difference(volume, &halves[0].solution, &halves[1].solution,
			      &made->halves_differ_m)) {
		diag_add(diag,
			 "half of the views is too few to calibrate from; take twice as many");
		return -EINVAL;
	}
	swap_cameras(halves);
	err = run_halves(halves, STAGES_POSES, settings->seconds_max, diag);
	made->held_out_rms_px = rms_of(halves);
	return err;
}

int cross_check(struct cross_check *check, const struct observations *observations,
		const struct seed *seed, const struct solution *solution,
		const struct volume *volume, const struct solve_settings *settings,
		struct diag *diag)
{
	struct half *halves = calloc(2, sizeof(*halves));
	struct cross_check made = {0};

	if (!halves)
		return -ENOMEM;
	int err = check_halves(halves, &made, observations, seed, solution, volume, settings, diag);
	half_finish(&halves[0]);
	half_finish(&halves[1]);
	free(halves);
	if (!err)
		*check = made;
	return err;
}
