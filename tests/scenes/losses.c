/*
 * Where names are lost: plays a scene at blob level and tells of each stretch of shots in which a
 * marker that three cameras see has no name, or a wrong one, how it began.
 * scene_losses [scene] [seed] [seconds] [speed_m_s] [cameras] [rate_hz] [optics]; LOSSES_VERBOSE=1
 * lists each.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim/play.h"

enum cause {
	CAUSE_START,    /* never named before */
	CAUSE_BACK,     /* it was hidden */
	CAUSE_NO_POINT, /* nothing is measured there */
	CAUSE_NEAR,     /* another marker is within 3 mm */
	CAUSE_WITHHELD, /* a point is there, and had its name the shot before */
	CAUSE_WRONG,
	CAUSE_COUNT
};

static const char *const CAUSES[CAUSE_COUNT] = {"start", "back",     "no point",
						"near",  "withheld", "wrong"};

struct stretch {
	bool lost, ever;
	uint64_t from, hidden, hidden_before; /* shots */
	enum cause cause;
	double off_m; /* of the prediction when it began */
	int with_point, wrong;
};

struct tally {
	uint64_t seen3, predicted, far, inside; /* hidden ones: predicted, off by 3 mm, in 95 % */
	double predicted2_m2;
	uint64_t stretches[CAUSE_COUNT], shots[CAUSE_COUNT];
};

static double argument(int argc, char **argv, int index, double other)
{
	return argc > index ? atof(argv[index]) : other;
}

static int point_near(const struct marker_set *set, struct vec3 p_stage_m)
{
	for (uint32_t i = set->label_count; i < set->marker_count; i++)
		if (vec3_distance(set->markers[i].p_stage_m, p_stage_m) < SCORE_NEAR_M)
			return set->markers[i].camera_count;
	return 0;
}

static double nearest_m(const struct sim_truth *t, uint32_t label)
{
	double least_m = 1;

	for (uint32_t i = 0; i < t->marker_count; i++)
		if (i != label && t->markers[i].worn)
			least_m = fmin(least_m, vec3_distance(t->markers[i].p_stage_m,
							      t->markers[label].p_stage_m));
	return least_m;
}

static void end_stretch(const struct sim_play *stage, struct stretch *s, uint32_t i, uint64_t now,
			struct tally *tally)
{
	uint64_t shots = now - s->from;

	if (!s->lost)
		return;
	s->lost = false;
	if (s->wrong)
		s->cause = CAUSE_WRONG;
	tally->stretches[s->cause]++;
	tally->shots[s->cause] += shots;
	if (getenv("LOSSES_VERBOSE"))
		printf("%-16s from %lu for %lu: %s, hidden %lu, off %.2f mm, with a point %d, "
		       "wrong %d\n",
		       sim_scene_layout(stage->scene)->markers[i].name, (unsigned long)s->from,
		       (unsigned long)shots, CAUSES[s->cause], (unsigned long)s->hidden_before,
		       1e3 * s->off_m, s->with_point, s->wrong);
}

static enum cause cause_of(const struct sim_play *stage, const struct stretch *s, uint32_t i)
{
	const struct sim_truth_marker *own = &stage->truth.markers[i];

	if (!s->ever)
		return CAUSE_START;
	if (nearest_m(&stage->truth, i) < SCORE_NEAR_M)
		return CAUSE_NEAR;
	if (s->hidden)
		return CAUSE_BACK;
	return point_near(&stage->set, own->p_stage_m) ? CAUSE_WITHHELD : CAUSE_NO_POINT;
}

static void look(const struct sim_play *stage, struct stretch *s, uint32_t i, struct tally *tally)
{
	const struct sim_truth_marker *own = &stage->truth.markers[i];
	const struct marker *m = &stage->set.markers[i];
	uint64_t shot = stage->set.shot;
	bool named = m->status >= MARKER_TWO_CAMERA;
	bool right = named && score_judge(&stage->truth, i, m) == SCORE_RIGHT;
	bool seen = __builtin_popcount(own->visible_mask & ~stage->set.missing_mask) >= 3;

	tally->seen3 += seen;
	if (m->status == MARKER_PREDICTED && own->worn &&
	    __builtin_popcount(own->visible_mask) < 2) {
		double e_m = vec3_distance(m->p_stage_m, own->p_stage_m);

		if (getenv("LOSSES_HIDDEN"))
			printf("hidden %lu %s %.2f mm sigma %.2f\n", (unsigned long)shot,
			       sim_scene_layout(stage->scene)->markers[i].name, 1e3 * e_m,
			       1e3 * sqrt(m->cov_m2[0]));
		tally->predicted++;
		tally->far += e_m > SCORE_NEAR_M;
		tally->predicted2_m2 += e_m * e_m;
		tally->inside += e_m * e_m < 7.815 * m->cov_m2[0];
	}
	if (named && !right && !s->lost) {
		s->from = shot, s->lost = true, s->with_point = s->wrong = 0;
		s->cause = CAUSE_WRONG;
	}
	if (named && __builtin_popcount(own->visible_mask) < 2 && getenv("LOSSES_HIDDEN"))
		printf("unseen %lu %s cameras %x of %x off %.2f mm hidden %lu\n",
		       (unsigned long)shot, sim_scene_layout(stage->scene)->markers[i].name,
		       m->camera_mask, own->visible_mask,
		       1e3 * vec3_distance(m->p_stage_m, own->p_stage_m), (unsigned long)s->hidden);
	if (seen && !right && !s->lost) {
		s->lost = true;
		s->hidden_before = s->hidden;
		s->from = shot;
		s->cause = cause_of(stage, s, i);
		s->off_m = vec3_distance(m->p_stage_m, own->p_stage_m);
		s->with_point = s->wrong = 0;
	} else if (s->lost && (right || (!seen && !named))) {
		end_stretch(stage, s, i, shot, tally);
	}
	if (s->lost) {
		s->with_point += point_near(&stage->set, own->p_stage_m) >= 3;
		s->wrong += named && !right;
	}
	s->ever |= right;
	s->hidden = seen || right ? 0 : s->hidden + 1;
}

int main(int argc, char **argv)
{
	static struct sim_play stage;
	static struct stretch stretches[LABEL_MAX];
	struct sim_options options = {.scene = argc > 1 ? argv[1] : "talking",
				      .seed = (uint64_t)argument(argc, argv, 2, 1),
				      .face_speed_m_s = argument(argc, argv, 4, 0),
				      .camera_count = (uint32_t)argument(argc, argv, 5, 0),
				      .rate_hz = argument(argc, argv, 6, 0),
				      .optics = argc > 7 ? argv[7] : NULL};
	struct tally tally = {0};
	struct diag diag = {0};
	struct score score;

	if (sim_play_init(&stage, &options, &diag)) {
		diag_print(&diag, stderr);
		return 1;
	}
	uint64_t shots = (uint64_t)(argument(argc, argv, 3, 20) * 1e9 /
				    (double)sim_scene_period_ns(stage.scene));
	uint32_t count = sim_scene_layout(stage.scene)->marker_count;
	score_init(&score);
	for (uint64_t n = 0; n < shots; n++) {
		sim_play_shot_us(&stage, &(struct blob_play){0}, n, 0);
		score_shot(&score, &stage.truth, &stage.set);
		if (getenv("LOSSES_HEAD"))
			printf("head %lu valid %d rigid %d residual %.3f mm off %.2f points %u\n",
			       (unsigned long)n, stage.set.heads[0].valid,
			       stage.set.heads[0].rigid_count, 1e3 * stage.set.heads[0].residual_m,
			       1e3 * vec3_distance(stage.set.heads[0].rt_stage_head.t,
						   stage.truth.actors[0].rt_stage_head.t),
			       stage.set.marker_count - stage.set.label_count);
		for (uint32_t i = 0; i < count; i++)
			look(&stage, &stretches[i], i, &tally);
	}
	for (uint32_t i = 0; i < count; i++)
		end_stretch(&stage, &stretches[i], i, shots, &tally);
	printf("%-24s %7lu %.2f right %.3f wrong %lu swaps %lu unseen %lu us %.0f |", options.scene,
	       (unsigned long)options.seed, options.face_speed_m_s,
	       100 * (double)score.right / (double)score.seen3, (unsigned long)score.wrong,
	       (unsigned long)score.swapped, (unsigned long)score.unseen,
	       stage.cost.tracker_us / (double)shots);
	for (int c = 0; c < CAUSE_COUNT; c++)
		printf(" %s %lu/%.3f%%", CAUSES[c], (unsigned long)tally.stretches[c],
		       100 * (double)tally.shots[c] / (double)tally.seen3);
	printf(" | hidden %lu rms %.2f far %.1f%% in95 %.1f%%\n", (unsigned long)tally.predicted,
	       1e3 * sqrt(tally.predicted2_m2 / (double)tally.predicted),
	       100.0 * (double)tally.far / (double)tally.predicted,
	       100.0 * (double)tally.inside / (double)tally.predicted);
	sim_play_finish(&stage);
	return 0;
}
