/*
 * What the files of the session share.
 */
#pragma once

#include "calib/actor/actor_learn.h"
#include "calib/actor/actor_pose.h"
#include "calib/actor/actor_rest.h"
#include "ctl/calibrate/actor_session.h"

struct actor_session {
	struct actor_feed *feed;
	struct actor_screen *screen;
	const struct actor_wish *wish;
	struct diag *diag;
	struct actor_journal journal;
	struct actor_capture capture;
	struct actor_neutral neutral;
	struct actor_rest_finder finder;
	struct actor_rest ended; /* room for a rest that is over */
	struct actor_pose pose;
	struct actor_part part; /* under way */
	struct actor_shot shot;
	int64_t since_ns;   /* when this part was asked for; 0 = with the next shot */
	int64_t head_ns;    /* when the head was last found */
	int64_t arrived_ns; /* when a shot last came; CLOCK_MONOTONIC */
	bool lost;          /* the operator was told that the head is not found */
	bool paused, quiet; /* quiet: told that no shots come */
	int key;            /* just pressed, or 0 */
	int index;          /* pose under way */
	int code;           /* exit code, once it is over */
};

enum actor_step {
	STEP_SHOT, /* session->shot is new */
	STEP_NONE, /* paused, or nothing came */
	STEP_OVER, /* session->code says why */
};

/* Waits for a shot and sees to keys, interrupts and a lost head. */
enum actor_step actor_session_step(struct actor_session *s);

/* Without an operator at a terminal who decides, waiting ends. */
bool actor_session_is_timed(const struct actor_session *s);
double actor_session_waited_s(const struct actor_session *s);

/* Both return STEP_SHOT when done, else STEP_OVER. */
enum actor_step actor_session_neutral(struct actor_session *s);
enum actor_step actor_session_poses(struct actor_session *s);
