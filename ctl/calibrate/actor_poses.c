/*
 * The script: one pose after the other is asked for, seen, and kept.
 */
#include <errno.h>
#include <string.h>

#include "base/exit_codes.h"
#include "calib/actor/actor_script.h"
#include "ctl/calibrate/actor_session_parts.h"

#define LONGEST_S 15.0 /* a pose that does not end is taken as it is */

static const char *const phase_names[] = {"waiting", "reached - hold", "held - and back", "done"};

static void use_neutral(struct actor_session *s)
{
	struct actor_pose *pose = &s->pose;

	pose->count = s->feed->count;
	for (uint32_t i = 0; i < pose->count; i++) {
		const struct layout_marker *marker = &s->feed->layout.markers[i];

		pose->on_face[i] = !marker->rigid && !marker->segment[0] && s->neutral.shots[i] > 0;
		pose->neutral_m[i] = s->neutral.mean_m[i];
	}
}

static void ask(struct actor_session *s)
{
	const struct actor_prompt *prompt = &ACTOR_PROMPTS[s->index];

	s->since_ns = 0;
	actor_part_clear(&s->part);
	actor_pose_next(&s->pose);
	actor_screen_say(s->screen,
			 json_pack("{s:s, s:s, s:i, s:i, s:s}", "event", "pose", "pose",
				   prompt->name, "index", s->index + 1, "count", ACTOR_POSE_COUNT,
				   "prompt", prompt->text),
			 "%2d of %d  %s: hold it for a moment, then relax", s->index + 1,
			 ACTOR_POSE_COUNT, prompt->text);
}

static void say_outcome(struct actor_session *s, int outcome)
{
	const char *name = ACTOR_PROMPTS[s->index].name;
	json_t *facts = json_pack("{s:s, s:s, s:f, s:b}", "event", actor_outcome_name(outcome),
				  "pose", name, "moved_mm", 1e3 * s->pose.moved_max_m, "held",
				  (int)s->pose.was_held);

	if (outcome == OUTCOME_CAPTURED)
		actor_screen_say(s->screen, facts, "          captured, %.1f mm%s",
				 1e3 * s->pose.moved_max_m,
				 s->pose.was_held ? "" : ", not held still");
	else if (outcome == OUTCOME_SKIPPED)
		actor_screen_say(s->screen, facts, "          skipped");
	else
		actor_screen_say(s->screen, facts, "          the face did not move: left out");
}

static enum actor_step keep(struct actor_session *s, int outcome)
{
	const char *name = ACTOR_PROMPTS[s->index].name;
	struct actor_part other = s->capture.poses[s->index];

	if (outcome != OUTCOME_CAPTURED)
		actor_part_clear(&s->part);
	s->capture.poses[s->index] = s->part;
	s->capture.outcomes[s->index] = outcome;
	s->part = other;
	say_outcome(s, outcome);
	int err = actor_journal_add(&s->journal, name, outcome, &s->capture.poses[s->index]);
	if (!err)
		return STEP_SHOT;
	diag_add(s->diag, "%s: %s", s->journal.path, strerror(-err));
	s->code = EXIT_CODE_INTERNAL;
	return STEP_OVER;
}

/* Goes back to the pose under way, or to the one before when none is. */
static void repeat(struct actor_session *s)
{
	if (s->pose.phase == POSE_WAITING && s->index > 0)
		s->index--;
	ask(s);
}

/* What comes of the pose with this shot; OUTCOME_OPEN: not decided. */
static int follow(struct actor_session *s)
{
	if (s->key == 's')
		return OUTCOME_SKIPPED;
	if (!s->shot.head_found)
		return OUTCOME_OPEN;
	enum actor_pose_phase phase = actor_pose_step(&s->pose, &s->shot);
	if (phase == POSE_RETURNED)
		return OUTCOME_CAPTURED;
	if (!actor_session_is_timed(s))
		return OUTCOME_OPEN;
	if (phase == POSE_WAITING)
		return actor_session_waited_s(s) > s->wish->pose_s ? OUTCOME_NOT_SEEN
								   : OUTCOME_OPEN;
	return actor_session_waited_s(s) > s->wish->pose_s + LONGEST_S ? OUTCOME_CAPTURED
								       : OUTCOME_OPEN;
}

static enum actor_step capture_pose(struct actor_session *s)
{
	int outcome = OUTCOME_OPEN;

	ask(s);
	while (outcome == OUTCOME_OPEN) {
		enum actor_step step = actor_session_step(s);

		if (step == STEP_OVER)
			return step;
		if (s->key == 'r')
			repeat(s);
		if (step == STEP_NONE)
			continue;
		outcome = follow(s);
		if (s->shot.head_found && actor_part_add(&s->part, &s->shot) < 0) {
			s->code = EXIT_CODE_INTERNAL;
			return STEP_OVER;
		}
		actor_screen_show(s->screen, s->index, ACTOR_POSE_COUNT,
				  "%-16s %4.1f mm   r again  s skip  p pause  q stop",
				  s->shot.head_found ? phase_names[s->pose.phase]
						     : "head not found",
				  1e3 * s->pose.moved_m);
	}
	return keep(s, outcome);
}

enum actor_step actor_session_poses(struct actor_session *s)
{
	use_neutral(s);
	for (s->index = 0; s->index < ACTOR_POSE_COUNT; s->index++)
		if (s->capture.outcomes[s->index] == OUTCOME_OPEN && capture_pose(s) == STEP_OVER)
			return STEP_OVER;
	return STEP_SHOT;
}
