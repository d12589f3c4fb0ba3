/*
 * The pulse ledger at work: it judges the front of each camera's queue once, tells the solver which
 * shot that belongs to, and shows its counts to the other threads.
 */
#pragma once

#include "daemon/capture.h"
#include "daemon/pulses.h"
#include "track/aim_check.h"
#include "track/naming_check.h"
#include "track/sync/ledger.h"
#include "track/sync/step_check.h"

/* What the ledger has found about one camera; the solver writes, any thread reads. */
struct camera_events {
	_Atomic uint64_t counts[LEDGER_EVENT_COUNT];
	_Atomic uint64_t total;
	_Atomic uint64_t last_shot;    /* of the last event, once total is not 0 */
	_Atomic uint32_t last_event;   /* enum ledger_event */
	_Atomic int64_t after_edge_ns; /* mean of frames' times - what their edges asked for */
	_Atomic double moved_px, moved_mrad; /* how far its picture seems off */
	_Atomic bool slower, out_of_step, dark, overexposed, moved; /* now */
};

/* Whether spots become markers with names, of the newest block; likewise. */
struct names_seen {
	_Atomic uint32_t naming; /* enum naming */
	_Atomic uint32_t blocks; /* in a row that were not fine */
	_Atomic double spots, points, named;
};

struct shot_book {
	/* set before the thread starts */
	struct pulses *pulses; /* borrowed; NULL when no trigger reports edges */

	/* solver thread */
	struct ledger ledger;
	struct step_check step;
	struct aim_check aim;
	struct naming_check naming;
	uint32_t judged_mask;            /* cameras whose front is judged ... */
	struct front judged[CAMERA_MAX]; /* ... as this */

	struct camera_events cameras[CAMERA_MAX];
	struct names_seen names;
};

/* Before a run. Control thread. */
void shot_book_begin(struct shot_book *book, struct pulses *pulses, int64_t period_ns);

/* Solver thread, as all below. Takes the edges that have come; the oldest one whose shot is not
 * closed, as a front that asks for its mid-exposure. */
struct front shot_book_edge(struct shot_book *book);
void shot_book_edge_used(struct shot_book *book);

/* The front of a queue with its shot; drops those that the ledger refuses. `set` gets the front, or
 * NULL. `final`: no edge is waited for. */
struct front shot_book_front(struct shot_book *book, struct capture *capture, uint32_t camera,
			     bool ended, bool final, const struct blob_set **set);

/* A front was too late for its shot, of which no pulse told. */
void shot_book_late(struct shot_book *book, uint32_t camera, uint64_t shot);

/* The front was taken from its queue. */
void shot_book_taken(struct shot_book *book, uint32_t camera);

/* The shot of an HD frame, SHOT_UNKNOWN before the first edge; false: refused. Only where the
 * trigger reports edges. */
bool shot_book_hd_frame(struct shot_book *book, uint32_t camera, const struct ledger_frame *frame,
			uint64_t *shot);

/* A shot was closed; `set` is what was tracked in it, or NULL. */
void shot_book_close(struct shot_book *book, const struct tracker_rig *rig, const struct shot *shot,
		     const struct marker_set *set);
