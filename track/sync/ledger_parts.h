/*
 * What the files of the pulse ledger share: one frame while it is judged.
 */
#pragma once

#include "track/sync/ledger.h"

#define REBASE_FRAMES 4     /* in a row on another line, until that is the camera's */
#define SEQ_GAP_MAX 1000000 /* a larger step is not a count of frames */
#define ARRIVALS_KNOWN 120  /* before, the least time to arrival proves nothing */

struct judging {
	struct ledger *ledger;
	struct ledger_camera *camera;
	const struct ledger_frame *frame;
	int64_t edge_time_ns; /* the mid-exposure of IR cameras on the same pulse */
	uint64_t nearest;     /* the shot that its time names */
	uint64_t timed;       /* the same, without an HD camera's slip */
	uint64_t seq_step;    /* since the line's last frame */
	uint64_t counted;     /* the shot that the counter names */
	bool has_counted;
};

static inline int64_t elapsed_ns(int64_t from_ns, int64_t to_ns)
{
	int64_t difference_ns;

	if (__builtin_sub_overflow(to_ns, from_ns, &difference_ns))
		return to_ns > from_ns ? INT64_MAX : INT64_MIN;
	return difference_ns;
}

static inline bool goes_back(uint64_t from_seq, uint64_t to_seq)
{
	return (int64_t)(to_seq - from_seq) < 0;
}

/* Counts an event, and keeps it as the last. */
void ledger_note(struct ledger_camera *camera, enum ledger_event event, uint64_t shot,
		 uint64_t count);

/* A frame of that shot would have come before it could. */
bool ledger_too_soon_for(const struct judging *j, uint64_t shot);

/* It comes as soon as a frame of that shot usually does. */
bool ledger_arrives_as(const struct judging *j, uint64_t shot);

/* Its line is beyond dispute, and so is how soon its frames can arrive. */
bool ledger_is_settled(const struct ledger_camera *camera);

/* The counter of a settled camera says what its time says, or what its arrival does where the time
 * cannot be true: a pulse that is still to be reported could but agree. Else it may tell of pulses
 * that were not fired. */
bool ledger_needs_no_edge(const struct judging *j);

/* At the margin between two pulses the time leaves the choice to the counter. */
bool ledger_time_allows(const struct judging *j, uint64_t shot);

/* Takes the frame on to its camera's line, or refuses it; both are counted. */
enum ledger_verdict ledger_judge_by_line(struct judging *j);
