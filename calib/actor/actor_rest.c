/*
 * Blocks of a tenth of a second, so that noise does not look like motion and blinks cost no more
 * than the lids' markers.
 */
#include "calib/actor/actor_rest.h"

#include <string.h>

#include "base/clock.h"

#define BLOCK_NS (NS_PER_S / 10)
#define STILL_M 0.0004   /* a marker nearer to the run's mean stands still ... */
#define STILL_SHARE 0.88 /* ... and so must this share of them: not those of the lids */
#define SEEN_SHARE 0.5   /* of the markers, in a block that tells anything */
#define NEIGHBOURS 6
#define NEIGHBOUR_M 0.045
#define SHARED_MEAN_M 0.0015
#define SHARED_MAX_M 0.004
#define FAR_SHARE 0.2

void actor_rest_begin(struct actor_rest_finder *finder)
{
	memset(finder, 0, sizeof(*finder));
}

double actor_rest_s(const struct actor_rest *rest)
{
	return rest->begin_ns ? (double)(rest->end_ns - rest->begin_ns) / NS_PER_S : 0;
}

static void add_to_block(struct actor_rest_finder *f, const struct actor_shot *shot)
{
	struct actor_rest *block = &f->block;

	if (f->block_shots++ == 0) {
		memset(block, 0, sizeof(*block));
		block->begin_ns = shot->mid_exposure_ns;
		block->count = shot->count;
	}
	block->end_ns = shot->mid_exposure_ns;
	for (uint32_t i = 0; i < shot->count; i++) {
		if (!shot->seen[i])
			continue;
		struct vec3 off = vec3_sub(shot->p_m[i], block->mean_m[i]);
		block->shots[i]++;
		block->mean_m[i] =
			vec3_add(block->mean_m[i], vec3_scale(off, 1.0 / block->shots[i]));
	}
}

static bool stands_still(const struct actor_rest *run, const struct actor_rest *block, uint32_t i)
{
	return vec3_distance(run->mean_m[i], block->mean_m[i]) < STILL_M;
}

static bool block_rests(const struct actor_rest *run, const struct actor_rest *block)
{
	uint32_t compared = 0, still = 0;

	for (uint32_t i = 0; i < block->count; i++) {
		if (!run->shots[i] || !block->shots[i])
			continue;
		compared++;
		still += stands_still(run, block, i);
	}
	return compared >= SEEN_SHARE * block->count && still >= STILL_SHARE * compared;
}

/* A marker that moves while the others rest - a lid - has no part in the mean. */
static void join_block(struct actor_rest *run, const struct actor_rest *block)
{
	for (uint32_t i = 0; i < block->count; i++) {
		if (!block->shots[i] || (run->shots[i] && !stands_still(run, block, i)))
			continue;
		double share = (double)block->shots[i] / (run->shots[i] + block->shots[i]);
		run->shots[i] += block->shots[i];
		run->mean_m[i] =
			vec3_add(run->mean_m[i],
				 vec3_scale(vec3_sub(block->mean_m[i], run->mean_m[i]), share));
	}
	run->end_ns = block->end_ns;
}

bool actor_rest_step(struct actor_rest_finder *f, const struct actor_shot *shot,
		     struct actor_rest *ended)
{
	bool over = false;

	if (!shot->head_found) {
		f->block_shots = 0;
		over = f->run.begin_ns != 0;
		if (over)
			*ended = f->run;
		f->run.begin_ns = 0;
		return over;
	}
	add_to_block(f, shot);
	if (f->block.end_ns - f->block.begin_ns < BLOCK_NS)
		return false;
	f->block_shots = 0;
	if (f->run.begin_ns && block_rests(&f->run, &f->block)) {
		join_block(&f->run, &f->block);
		return false;
	}
	over = f->run.begin_ns != 0;
	if (over)
		*ended = f->run;
	f->run = f->block;
	return over;
}

static bool on_face(const struct layout_marker *marker)
{
	return !marker->rigid && !marker->segment[0];
}

/* The mean displacement of the nearest others on the face, this one left out. */
static bool shared_displacement(const struct actor_rest *rest, const struct layout *layout,
				uint32_t marker, double *shared_m)
{
	struct vec3 at_m = layout->markers[marker].neutral_m, sum = {0, 0, 0};
	double limit_m = 0;
	int count = 0;

	for (int k = 0; k < NEIGHBOURS; k++) {
		double best_m = NEIGHBOUR_M;
		int best = -1;

		for (uint32_t i = 0; i < layout->marker_count; i++) {
			double d = vec3_distance(layout->markers[i].neutral_m, at_m);

			if (i == marker || !on_face(&layout->markers[i]) || !rest->shots[i] ||
			    d <= limit_m || d >= best_m)
				continue;
			best_m = d;
			best = (int)i;
		}
		if (best < 0)
			break;
		limit_m = best_m;
		sum = vec3_add(sum, vec3_sub(rest->mean_m[best], layout->markers[best].neutral_m));
		count++;
	}
	if (count < 4)
		return false;
	*shared_m = vec3_norm(sum) / count;
	return true;
}

struct actor_neutral_fit actor_rest_fit(const struct actor_rest *rest, const struct layout *layout)
{
	struct actor_neutral_fit fit = {0};
	double sum2_m2 = 0, shared_sum_m = 0, shared_m;
	uint32_t seen = 0, told = 0;

	for (uint32_t i = 0; i < layout->marker_count; i++) {
		if (!on_face(&layout->markers[i]))
			continue;
		fit.markers++;
		if (!rest->shots[i]) {
			fit.unseen++;
			continue;
		}
		double off_m = vec3_distance(rest->mean_m[i], layout->markers[i].neutral_m);
		seen++;
		sum2_m2 += off_m * off_m;
		fit.far += off_m > ACTOR_FAR_M;
		if (!shared_displacement(rest, layout, i, &shared_m))
			continue;
		told++;
		shared_sum_m += shared_m;
		fit.shared_max_m = fmax(fit.shared_max_m, shared_m);
	}
	fit.residual_m = seen ? sqrt(sum2_m2 / seen) : 0;
	fit.shared_m = told ? shared_sum_m / told : 0;
	fit.is_neutral = told >= SEEN_SHARE * fit.markers && fit.shared_m < SHARED_MEAN_M &&
			 fit.shared_max_m < SHARED_MAX_M && fit.far <= FAR_SHARE * fit.markers;
	return fit;
}
