/*
 * keep runs on the capture thread, place and stamp on the solver's: none of them allocates, locks
 * or logs.
 */
#include "daemon/hd_capture.h"

#include <errno.h>
#include <string.h>

#include "base/clock.h"
#include "daemon/shot_book.h"

#define POOL_NS (300 * NS_PER_MS)
#define SLOTS_MIN 4

int hd_capture_init(struct hd_capture *hd, size_t frame_bytes, int64_t period_ns)
{
	int64_t slots = period_ns > 0 ? POOL_NS / period_ns + 2 : HD_POOL_SLOTS_MAX;

	memset(hd, 0, sizeof(*hd));
	atomic_store(&hd->last_shot, SHOT_UNKNOWN);
	slots = slots < SLOTS_MIN           ? SLOTS_MIN
		: slots > HD_POOL_SLOTS_MAX ? HD_POOL_SLOTS_MAX
					    : slots;
	int err = hd_pool_init(&hd->pool, (uint32_t)slots, frame_bytes);
	if (!err)
		err = ring_init(&hd->notes, sizeof(struct hd_note), (uint32_t)slots);
	if (err)
		hd_capture_finish(hd);
	return err;
}

void hd_capture_finish(struct hd_capture *hd)
{
	hd_pool_finish(&hd->pool);
	ring_finish(&hd->notes);
	memset(hd, 0, sizeof(*hd));
}

void hd_capture_begin_run(struct hd_capture *hd)
{
	ring_clear(&hd->notes);
	atomic_store(&hd->last_shot, SHOT_UNKNOWN);
	atomic_store(&hd->off_phase, 0);
}

static void copy_rows(struct hd_frame *to, const struct frame *from)
{
	size_t row_bytes = pixel_row_bytes(from->format, from->width_px);

	to->size_bytes = from->size_bytes ? from->size_bytes : row_bytes * (size_t)from->height_px;
	if (from->size_bytes || from->stride_bytes == (int)row_bytes) {
		memcpy(to->pixels, from->pixels, to->size_bytes);
		return;
	}
	for (int y = 0; y < from->height_px; y++)
		memcpy(to->pixels + (size_t)y * row_bytes,
		       from->pixels + (ptrdiff_t)y * from->stride_bytes, row_bytes);
}

/* 0 when there is no room. */
static uint64_t copy_frame(struct hd_pool *pool, const struct frame *from)
{
	struct hd_frame *to = from->size_bytes > pool->slot_bytes ? NULL : hd_pool_claim(pool);

	if (!to)
		return 0;
	to->width_px = from->width_px;
	to->height_px = from->height_px;
	to->format = from->format;
	to->mid_exposure_ns = from->mid_exposure_ns;
	to->uncertainty_ns = from->uncertainty_ns;
	to->arrival_ns = from->arrival_ns;
	to->row_time_ns = from->row_time_ns;
	atomic_store_explicit(&to->shot, SHOT_UNKNOWN, memory_order_relaxed);
	copy_rows(to, from);
	hd_pool_publish(pool, to);
	return to->seq;
}

bool hd_capture_keep(struct hd_capture *hd, const struct frame *frame)
{
	uint64_t seq = copy_frame(&hd->pool, frame);
	struct hd_note *note = ring_claim(&hd->notes);

	if (note) {
		*note = (struct hd_note){seq, frame->shot, frame->device_seq,
					 frame->mid_exposure_ns, frame->arrival_ns};
		ring_publish(&hd->notes);
	}
	return seq != 0 && note;
}

/* The shot nearest to the time at which the IR cameras were exposed in the frame's shot. */
static uint64_t nearest_shot(const struct hd_note *note, const struct hd_plan *plan,
			     const struct sync *sync)
{
	int64_t period_ns = sync->period_ns;
	int64_t since_ns = note->mid_exposure_ns - plan->after_ir_ns - sync->last_mid_exposure_ns;

	if (note->shot != SHOT_UNKNOWN)
		return note->shot;
	if (!sync->started || period_ns <= 0)
		return SHOT_UNKNOWN;
	int64_t half_ns = since_ns < 0 ? -period_ns / 2 : period_ns / 2;
	int64_t shots = (since_ns + half_ns) / period_ns;

	return shots < 0 && (uint64_t)-shots > sync->last_shot ? SHOT_UNKNOWN
							       : sync->last_shot + (uint64_t)shots;
}

static void place(struct hd_capture *hd, struct hd_plan *plan, uint64_t seq, uint64_t shot)
{
	uint32_t phase = (uint32_t)(shot % plan->divider);

	hd_pool_set_shot(&hd->pool, seq, shot);
	if (!plan->phase_known)
		plan->phase = phase;
	plan->phase_known = true;
	atomic_store_explicit(&hd->last_shot, shot, memory_order_relaxed);
	if (phase != plan->phase)
		atomic_fetch_add_explicit(&hd->off_phase, 1, memory_order_relaxed);
}

/* False: refused. */
static bool find_shot(const struct hd_note *note, const struct hd_plan *plan,
		      const struct sync *sync, struct shot_book *book, uint32_t camera,
		      uint64_t *shot)
{
	struct ledger_frame frame = {note->device_seq, note->mid_exposure_ns, note->arrival_ns};

	if (book)
		return shot_book_hd_frame(book, camera, &frame, shot);
	*shot = nearest_shot(note, plan, sync);
	return true;
}

uint64_t hd_capture_place(struct hd_capture *hd, struct hd_plan *plan, const struct sync *sync,
			  struct shot_book *book, uint32_t camera)
{
	const struct hd_note *note;
	uint64_t before_start = 0, shot;

	while ((note = ring_peek(&hd->notes, 0))) {
		if (find_shot(note, plan, sync, book, camera, &shot)) {
			if (shot == SHOT_UNKNOWN)
				before_start++;
			else
				place(hd, plan, note->pool_seq, shot);
		}
		ring_pop(&hd->notes);
	}
	return before_start;
}

void hd_plan_stamp(const struct hd_plan *plan, struct marker_set *set)
{
	bool known = plan->camera_mask && plan->phase_known;

	set->is_hd = known && set->shot % plan->divider == plan->phase;
	set->hd_phase = set->is_hd ? plan->phase : 0;
	set->hd_index = set->is_hd ? set->shot / plan->divider : 0;
	set->hd_mid_exposure_ns = set->is_hd ? set->mid_exposure_ns + plan->after_ir_ns : 0;
}
