/*
 * From shot to shot, and what is done at the end.
 */
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "base/output_file.h"
#include "calib/actor/actor_file.h"
#include "calib/actor/actor_points.h"
#include "ctl/calibrate/actor_session_parts.h"

#define LOST_SAY_S 2.0
#define LOST_END_S 30.0
#define QUIET_SAY_S 5.0
#define QUIET_END_S 30.0

static volatile sig_atomic_t interrupted;

static void note_interrupt(int signal_number)
{
	(void)signal_number;
	interrupted = 1;
}

bool actor_session_is_timed(const struct actor_session *s)
{
	return s->screen->kind != SCREEN_TERMINAL || !s->feed->kind->live;
}

double actor_session_waited_s(const struct actor_session *s)
{
	return s->since_ns ? (double)(s->shot.mid_exposure_ns - s->since_ns) / NS_PER_S : 0;
}

static enum actor_step end_early(struct actor_session *s, int code, const char *why)
{
	if (s->capture.neutral.shot_count)
		diag_add(s->diag,
			 "%s; all that was captured is kept in %s: the same command goes on from "
			 "there, with --fresh it begins anew",
			 why, s->journal.path);
	else
		diag_add(s->diag, "%s; nothing was captured yet", why);
	s->code = code;
	return STEP_OVER;
}

static enum actor_step end_of_feed(struct actor_session *s, int err)
{
	char why[160];

	if (err == -ENODATA && s->feed->kind->live)
		snprintf(why, sizeof(why), "the station ended the stream");
	else if (err == -ENODATA)
		snprintf(why, sizeof(why), "%s ended before the script did", s->feed->kind->place);
	else if (err == -ESTALE)
		snprintf(why, sizeof(why), "the station tracks other actors than at the beginning");
	else
		snprintf(why, sizeof(why), "%s: %s", s->feed->kind->place, strerror(-err));
	return end_early(s, s->feed->kind->live ? EXIT_CODE_CONNECTION : EXIT_CODE_INCOMPLETE, why);
}

/* Nothing came for a tenth of a second. */
static enum actor_step wait_for_shots(struct actor_session *s)
{
	double quiet_s = (double)(clock_now_ns() - s->arrived_ns) / NS_PER_S;

	if (quiet_s > QUIET_SAY_S && !s->quiet)
		actor_screen_say(s->screen, json_pack("{s:s}", "event", "no_shots"),
				 "The station sends no shots: is it running? (stagectl start)");
	s->quiet |= quiet_s > QUIET_SAY_S;
	if (quiet_s > QUIET_END_S && actor_session_is_timed(s))
		return end_early(s, EXIT_CODE_CONNECTION, "the station sends no shots");
	return STEP_NONE;
}

static void say_lost(struct actor_session *s)
{
	s->lost = true;
	actor_screen_say(
		s->screen,
		json_pack("{s:s, s:i}", "event", "head_lost", "points", (int)s->feed->loose),
		"The head of %s is not found (%u points without a name): inside the "
		"volume, band and markers as in the layout? Waiting.",
		s->wish->name, s->feed->loose);
}

static enum actor_step watch_head(struct actor_session *s)
{
	int64_t now_ns = s->shot.mid_exposure_ns;
	char why[200];

	if (s->shot.head_found && s->lost)
		actor_screen_say(s->screen, json_pack("{s:s}", "event", "head_found"),
				 "The head is found again.");
	if (s->shot.head_found || !s->head_ns) {
		s->lost &= !s->shot.head_found;
		s->head_ns = now_ns;
	}
	double lost_s = (double)(now_ns - s->head_ns) / NS_PER_S;
	if (lost_s > LOST_SAY_S && !s->lost)
		say_lost(s);
	if (lost_s <= LOST_END_S || !actor_session_is_timed(s))
		return STEP_SHOT;
	snprintf(why, sizeof(why),
		 "the head of %s was not found for %.0f s: outside the volume, or are these other "
		 "markers than the layout's?",
		 s->wish->name, LOST_END_S);
	return end_early(s, EXIT_CODE_INCOMPLETE, why);
}

static void watch_keys(struct actor_session *s)
{
	s->key = actor_screen_key(s->screen);
	if (s->key == 'q')
		interrupted = 1;
	if (s->key != 'p' && s->key != ' ')
		return;
	s->paused = !s->paused;
	s->since_ns = s->head_ns = 0;
	actor_screen_say(s->screen, json_pack("{s:s}", "event", s->paused ? "paused" : "goes_on"),
			 s->paused ? "Paused; p goes on." : "Going on.");
}

enum actor_step actor_session_step(struct actor_session *s)
{
	watch_keys(s);
	if (interrupted)
		return end_early(s, EXIT_CODE_INCOMPLETE, "interrupted");
	int err = s->feed->kind->next(s->feed, &s->shot);
	if (err == -EINTR)
		return STEP_NONE;
	if (err == -ETIMEDOUT)
		return wait_for_shots(s);
	if (err)
		return end_of_feed(s, err);
	s->arrived_ns = clock_now_ns();
	s->quiet = false;
	if (s->paused)
		return STEP_NONE;
	if (!s->since_ns)
		s->since_ns = s->shot.mid_exposure_ns;
	return watch_head(s);
}

static int write_file(struct actor_session *s, const char *path)
{
	char when[32], before[PATH_MAX + 8];
	time_t now = time(NULL);
	struct output_file file;
	struct tm utc;

	strftime(when, sizeof(when), "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &utc));
	if (output_file_open(&file, path, s->diag) < 0)
		return EXIT_CODE_INTERNAL;
	actor_file_write(file.stream, &s->feed->layout, when);
	snprintf(before, sizeof(before), "%s.before", path);
	/* the name stays with the earlier one until the new one has it */
	unlink(before);
	if (link(path, before) == 0 || rename(path, before) == 0)
		actor_screen_say(s->screen,
				 json_pack("{s:s, s:s}", "event", "kept", "file", before),
				 "The earlier %s is now %s.", path, before);
	return output_file_commit(&file, s->diag) < 0 ? EXIT_CODE_INTERNAL : EXIT_CODE_OK;
}

static void say_done(struct actor_session *s, const char *path)
{
	int count[4] = {0};
	uint32_t learned = 0, points = 0;

	for (int k = 0; k < ACTOR_POSE_COUNT; k++)
		count[s->capture.outcomes[k]]++;
	for (uint32_t i = 0; i < s->feed->layout.marker_count; i++) {
		learned += s->feed->layout.markers[i].learned.known;
		points += s->feed->layout.markers[i].mpeg4[0] != 0;
	}
	actor_screen_say(
		s->screen,
		json_pack("{s:s, s:s, s:i, s:i, s:i, s:i, s:i}", "event", "done", "file", path,
			  "captured", count[OUTCOME_CAPTURED], "skipped", count[OUTCOME_SKIPPED],
			  "not_seen", count[OUTCOME_NOT_SEEN], "learned", (int)learned, "mpeg4",
			  points),
		"Done: %d poses captured, %d skipped, %d not seen; %u markers learned, %d "
		"of them MPEG-4 feature points.\nWritten: %s. Name it under `layout` in the "
		"station's config.",
		count[OUTCOME_CAPTURED], count[OUTCOME_SKIPPED], count[OUTCOME_NOT_SEEN], learned,
		points, path);
}

/* The journal has done its work once the actor's file is there. */
static int finish(struct actor_session *s)
{
	struct layout *layout = &s->feed->layout;
	char path[PATH_MAX];

	actor_learn(layout, &s->neutral, s->capture.poses, ACTOR_POSE_COUNT);
	actor_points_name(layout);
	snprintf(layout->actors[0].name, NAME_BYTES, "%s", s->wish->name);
	if (snprintf(path, sizeof(path), "%s/%s.yaml", s->wish->out_dir, s->wish->name) >=
	    (int)sizeof(path))
		return EXIT_CODE_BAD_INPUT;
	int code = write_file(s, path);
	if (code != EXIT_CODE_OK)
		return code;
	unlink(s->journal.path);
	say_done(s, path);
	return EXIT_CODE_OK;
}

static int open_journal(struct actor_session *s)
{
	char path[PATH_MAX];

	if (mkdir(s->wish->out_dir, 0777) < 0 && errno != EEXIST) {
		diag_add(s->diag, "%s: cannot make the directory: %s", s->wish->out_dir,
			 strerror(errno));
		return EXIT_CODE_INTERNAL;
	}
	if (snprintf(path, sizeof(path), "%s/%s.capture", s->wish->out_dir, s->wish->name) >=
	    (int)sizeof(path)) {
		diag_add(s->diag, "%s: path too long", s->wish->out_dir);
		return EXIT_CODE_BAD_INPUT;
	}
	return actor_journal_open(&s->journal, &s->capture, path, &s->feed->layout, s->wish->fresh,
				  s->diag);
}

static void catch_interrupts(void)
{
	struct sigaction action = {.sa_handler = note_interrupt};

	interrupted = 0;
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
}

int actor_session_run(struct actor_feed *feed, struct actor_screen *screen,
		      const struct actor_wish *wish, struct diag *diag)
{
	struct actor_session *s = calloc(1, sizeof(*s));

	if (!s)
		return EXIT_CODE_INTERNAL;
	s->feed = feed;
	s->screen = screen;
	s->wish = wish;
	s->diag = diag;
	s->arrived_ns = clock_now_ns();
	catch_interrupts();
	int code = open_journal(s);
	if (code == EXIT_CODE_OK) {
		if (actor_session_neutral(s) == STEP_OVER || actor_session_poses(s) == STEP_OVER)
			code = s->code;
		else
			code = finish(s);
	}
	if (s->journal.file && !s->capture.neutral.shot_count)
		unlink(s->journal.path); /* nothing is in it */
	actor_journal_close(&s->journal);
	actor_capture_finish(&s->capture);
	actor_part_finish(&s->part);
	free(s);
	return code;
}
