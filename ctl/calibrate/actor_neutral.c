/*
 * The first thing that is captured: two seconds of a face at rest.
 */
#include <errno.h>
#include <string.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/calibrate/actor_session_parts.h"

#define REST_S 2.0
#define WAIT_SAY_S 15.0
#define WAIT_END_S 60.0
#define WRONG_SHARE 0.2 /* of the face's markers: then it is not this layout's */
#define MOVED_M 0.001   /* the markers sit elsewhere than when the capture began */

static enum actor_step refuse(struct actor_session *s, int code)
{
	s->code = code;
	return STEP_OVER;
}

static enum actor_step give_up(struct actor_session *s)
{
	diag_add(s->diag,
		 "no rest of %.0f s was seen within %.0f s: %s must look ahead, relax the face and "
		 "hold still%s",
		 REST_S, WAIT_END_S, s->wish->name,
		 s->feed->kind->live ? "" : "; the recording must begin with that");
	return refuse(s, EXIT_CODE_INCOMPLETE);
}

static enum actor_step refuse_layout(struct actor_session *s, const struct actor_neutral_fit *fit)
{
	diag_add(s->diag,
		 "head found, but %u of %u markers are more than %.0f mm from the layout and %u "
		 "more were not seen: is this %s? Put the right layout into the config or behind "
		 "--layout; with --anyway the markers are taken where they are",
		 fit->far, fit->markers, 1e3 * ACTOR_FAR_M, fit->unseen, s->wish->name);
	return refuse(s, EXIT_CODE_BAD_INPUT);
}

/* Rms distance of two neutrals over the markers that both know. */
static double apart_m(const struct actor_neutral *a, const struct actor_neutral *b)
{
	double sum2_m2 = 0;
	int count = 0;

	for (uint32_t i = 0; i < a->count && i < b->count; i++) {
		if (!a->shots[i] || !b->shots[i])
			continue;
		sum2_m2 += pow(vec3_distance(a->mean_m[i], b->mean_m[i]), 2);
		count++;
	}
	return count ? sqrt(sum2_m2 / count) : 0;
}

/* An earlier capture goes on only with the markers where they were. */
static enum actor_step go_on(struct actor_session *s)
{
	static struct actor_neutral now; /* this thread's; large */
	int open = 0;

	if (actor_neutral_learn(&s->part, &now) < 0 ||
	    actor_neutral_learn(&s->capture.neutral, &s->neutral) < 0)
		return refuse(s, EXIT_CODE_INTERNAL);
	if (apart_m(&now, &s->neutral) > MOVED_M) {
		diag_add(s->diag,
			 "the markers sit elsewhere than when this capture began (%.1f mm rms): "
			 "begin anew with --fresh",
			 1e3 * apart_m(&now, &s->neutral));
		return refuse(s, EXIT_CODE_BAD_INPUT);
	}
	for (int k = 0; k < ACTOR_POSE_COUNT; k++)
		open += s->capture.outcomes[k] == OUTCOME_OPEN;
	actor_screen_say(s->screen, json_pack("{s:s, s:i}", "event", "resumed", "open", open),
			 "An earlier capture goes on: %d of %d poses are left.", open,
			 ACTOR_POSE_COUNT);
	return STEP_SHOT;
}

static enum actor_step keep(struct actor_session *s, const struct actor_neutral_fit *fit)
{
	struct actor_part other = s->capture.neutral;

	actor_screen_say(s->screen,
			 json_pack("{s:s, s:i, s:i, s:i, s:f}", "event", "neutral", "markers",
				   (int)fit->markers, "unseen", (int)fit->unseen, "far",
				   (int)fit->far, "residual_mm", 1e3 * fit->residual_m),
			 "Neutral captured: %u of %u markers, %.2f mm rms from the layout.",
			 fit->markers - fit->unseen, fit->markers, 1e3 * fit->residual_m);
	if (s->capture.neutral.shot_count)
		return go_on(s);
	s->capture.neutral = s->part;
	s->part = other;
	int err = actor_journal_add(&s->journal, "neutral", OUTCOME_CAPTURED, &s->capture.neutral);
	if (err) {
		diag_add(s->diag, "%s: %s", s->journal.path, strerror(-err));
		return refuse(s, EXIT_CODE_INTERNAL);
	}
	return actor_neutral_learn(&s->capture.neutral, &s->neutral) < 0
		       ? refuse(s, EXIT_CODE_INTERNAL)
		       : STEP_SHOT;
}

/* STEP_NONE: it was an expression that was held. */
static enum actor_step judge(struct actor_session *s)
{
	struct actor_neutral_fit fit = actor_rest_fit(&s->finder.run, &s->feed->layout);

	if (!s->wish->anyway && fit.far + fit.unseen > WRONG_SHARE * fit.markers)
		return refuse_layout(s, &fit);
	if (fit.is_neutral || s->wish->anyway)
		return keep(s, &fit);
	actor_screen_say(
		s->screen,
		json_pack("{s:s, s:f}", "event", "expression", "shared_mm", 1e3 * fit.shared_max_m),
		"The face is still, but not neutral: neighbours lie %.1f mm aside together. "
		"Relax, mouth closed, eyes open.",
		1e3 * fit.shared_max_m);
	return STEP_NONE;
}

static void begin(struct actor_session *s)
{
	actor_rest_begin(&s->finder);
	actor_part_clear(&s->part);
}

static enum actor_step take(struct actor_session *s)
{
	enum actor_step done = STEP_NONE;

	if (actor_rest_step(&s->finder, &s->shot, &s->ended))
		actor_part_clear(&s->part);
	if (s->shot.head_found && actor_part_add(&s->part, &s->shot) < 0)
		return refuse(s, EXIT_CODE_INTERNAL);
	double rest_s = actor_rest_s(&s->finder.run);
	actor_screen_show(s->screen, (int)(10 * rest_s), (int)(10 * REST_S),
			  "look ahead, relax, hold still");
	if (rest_s >= REST_S) {
		done = judge(s);
		begin(s);
	}
	return done;
}

enum actor_step actor_session_neutral(struct actor_session *s)
{
	enum actor_step done = STEP_NONE;
	bool told = false;

	actor_screen_say(
		s->screen, json_pack("{s:s, s:f}", "event", "neutral_wanted", "seconds", REST_S),
		"Neutral: look ahead, relax the face, mouth closed, and hold still for %.0f "
		"seconds.",
		REST_S);
	begin(s);
	s->since_ns = 0;
	while (done == STEP_NONE) {
		enum actor_step step = actor_session_step(s);

		if (step == STEP_OVER)
			return step;
		if (step == STEP_NONE)
			continue;
		done = take(s);
		double waited_s = actor_session_waited_s(s);
		if (done == STEP_NONE && waited_s > WAIT_SAY_S && !told)
			actor_screen_say(s->screen, json_pack("{s:s}", "event", "no_rest"),
					 "The face does not rest yet: the head may move, the face "
					 "must not.");
		told |= waited_s > WAIT_SAY_S;
		if (done == STEP_NONE && waited_s > WAIT_END_S && actor_session_is_timed(s))
			return give_up(s);
	}
	return done;
}
