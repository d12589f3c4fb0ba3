/*
 * Solver thread. It neither allocates, locks nor logs.
 */
#include "daemon/shot_book.h"

#include <string.h>

#include "drivers/trigger_plan.h"
#include "track/shot.h"

void shot_book_begin(struct shot_book *book, struct pulses *pulses, int64_t period_ns)
{
	memset(book, 0, sizeof(*book));
	book->pulses = pulses;
	ledger_init(&book->ledger, period_ns);
}

static void show(struct shot_book *book, uint32_t camera)
{
	const struct ledger_camera *found = &book->ledger.cameras[camera];
	struct camera_events *shown = &book->cameras[camera];
	uint64_t total = 0;

	for (int e = 0; e < LEDGER_EVENT_COUNT; e++) {
		atomic_store_explicit(&shown->counts[e], found->counts[e], memory_order_relaxed);
		total += found->counts[e];
	}
	atomic_store_explicit(&shown->last_event, found->event, memory_order_relaxed);
	atomic_store_explicit(&shown->last_shot, found->event_shot, memory_order_relaxed);
	atomic_store_explicit(&shown->after_edge_ns, found->lag_ns, memory_order_relaxed);
	atomic_store_explicit(&shown->slower, found->slower, memory_order_relaxed);
	atomic_store_explicit(&shown->out_of_step, found->out_of_step, memory_order_relaxed);
	atomic_store_explicit(&shown->dark, found->dark, memory_order_relaxed);
	atomic_store_explicit(&shown->overexposed, found->overexposed, memory_order_relaxed);
	atomic_store_explicit(&shown->moved, found->moved, memory_order_relaxed);
	atomic_store_explicit(&shown->moved_px, found->moved_px, memory_order_relaxed);
	atomic_store_explicit(&shown->moved_mrad, found->moved_mrad, memory_order_relaxed);
	atomic_store_explicit(&shown->total, total, memory_order_release);
}

struct front shot_book_edge(struct shot_book *book)
{
	struct edges *edges = &book->ledger.edges;
	bool lost = atomic_load(&book->pulses->lost); /* before the queue: see what it left there */
	const struct edge *edge;

	while (!edges_full(edges) && (edge = ring_peek(&book->pulses->edges, 0))) {
		int64_t asked_ns = edge->edge_ns + trigger_plan_ir_middle_ns(&book->pulses->plan);

		if (!edges_add(edges, edge->shot, edge->missed, asked_ns))
			atomic_fetch_add_explicit(&book->pulses->edges_refused, 1,
						  memory_order_relaxed);
		ring_pop(&book->pulses->edges);
	}
	const struct pulse *next = edges_next(edges);
	if (!next)
		return (struct front){.state = lost ? FRONT_ENDED : FRONT_WAITING};
	return (struct front){FRONT_READY, next->shot, next->mid_exposure_ns};
}

void shot_book_edge_used(struct shot_book *book)
{
	edges_settle_next(&book->ledger.edges);
}

/* False: drop it. `front` is complete unless the frame must wait for its edge. */
static bool judge(struct shot_book *book, struct capture *capture, uint32_t camera, bool final,
		  const struct blob_set *set, struct front *front)
{
	struct ledger_frame frame = {set->device_seq, set->mid_exposure_ns, set->arrival_ns};
	enum ledger_verdict verdict = book->pulses
					      ? ledger_judge(&book->ledger, camera, &frame, final,
							     &front->shot, &front->mid_exposure_ns)
					      : ledger_watch(&book->ledger, camera, &frame);

	show(book, camera);
	if (verdict == LEDGER_WAIT)
		front->shot = SHOT_UNKNOWN;
	else if (verdict == LEDGER_TAKE)
		book->judged_mask |= UINT32_C(1) << camera;
	if (verdict == LEDGER_EARLY)
		atomic_fetch_add_explicit(&capture->counters.before_start, 1, memory_order_relaxed);
	return verdict == LEDGER_TAKE || verdict == LEDGER_WAIT;
}

struct front shot_book_front(struct shot_book *book, struct capture *capture, uint32_t camera,
			     bool ended, bool final, const struct blob_set **set)
{
	while ((*set = ring_peek(&capture->sets, 0))) {
		if (book->judged_mask >> camera & 1)
			return book->judged[camera];
		struct front front = front_of_queue(*set, ended);

		if (judge(book, capture, camera, final, *set, &front)) {
			book->judged[camera] = front;
			return front;
		}
		ring_pop(&capture->sets);
	}
	return front_of_queue(NULL, ended);
}

void shot_book_taken(struct shot_book *book, uint32_t camera)
{
	book->judged_mask &= ~(UINT32_C(1) << camera);
}

void shot_book_late(struct shot_book *book, uint32_t camera, uint64_t shot)
{
	ledger_note_late(&book->ledger, camera, shot);
	show(book, camera);
}

bool shot_book_hd_frame(struct shot_book *book, uint32_t camera, const struct ledger_frame *frame,
			uint64_t *shot)
{
	int64_t mid_exposure_ns;
	enum ledger_verdict verdict =
		ledger_judge(&book->ledger, camera, frame, true, shot, &mid_exposure_ns);

	show(book, camera);
	if (verdict == LEDGER_EARLY)
		*shot = SHOT_UNKNOWN;
	return verdict != LEDGER_REFUSE;
}

static int32_t count_saturated(const struct blob_set *set)
{
	int32_t count = 0;

	for (uint32_t b = 0; b < set->blob_count; b++)
		count += (set->blobs[b].flags & BLOB_SATURATED) != 0;
	return count;
}

static void note_blobs(struct shot_book *book, const struct shot *shot)
{
	struct ledger_blobs blobs[CAMERA_MAX];

	for (uint32_t c = 0; c < shot->camera_count; c++) {
		const struct blob_set *set = shot->sets[c];

		blobs[c] =
			set ? (struct ledger_blobs){(int32_t)set->blob_count, count_saturated(set)}
			    : (struct ledger_blobs){-1, 0};
	}
	ledger_note_blobs(&book->ledger, shot->number, blobs, shot->camera_count);
}

static void show_names(struct shot_book *book)
{
	const struct naming_check *found = &book->naming;
	struct names_seen *shown = &book->names;

	atomic_store_explicit(&shown->spots, found->means.spots, memory_order_relaxed);
	atomic_store_explicit(&shown->points, found->means.points, memory_order_relaxed);
	atomic_store_explicit(&shown->named, found->means.named, memory_order_relaxed);
	atomic_store_explicit(&shown->naming, found->naming, memory_order_relaxed);
	atomic_store_explicit(&shown->blocks, found->blocks_in_a_row, memory_order_release);
}

void shot_book_close(struct shot_book *book, const struct tracker_rig *rig, const struct shot *shot,
		     const struct marker_set *set)
{
	uint32_t camera;
	double off_shots;

	ledger_close(&book->ledger, shot->number);
	note_blobs(book, shot);
	if (set && step_check_run(&book->step, rig, shot, set, &camera, &off_shots))
		ledger_note_step(&book->ledger, camera, shot->number, off_shots);
	if (set && naming_check_run(&book->naming, rig, shot, set))
		show_names(book);
	if (set && aim_check_run(&book->aim, rig, shot, set))
		for (uint32_t c = 0; c < shot->camera_count; c++)
			ledger_note_aim(&book->ledger, c, shot->number, book->aim.aims[c].shift_px,
					book->aim.aims[c].turn_mrad);
}
