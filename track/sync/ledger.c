/*
 * A frame's way through the ledger: the pulse nearest to it, what its camera's line says of it, and
 * what it tells of its camera in turn.
 */
#include "track/sync/ledger_parts.h"

#include <string.h>

#define LAG_SHARE 16
#define ARRIVAL_LEAK_SHARE 100000 /* of a period and frame: 10 us/s at most */

static const char *const names[LEDGER_EVENT_COUNT] = {
	[LEDGER_DROPPED] = "dropped",
	[LEDGER_MISSED_TRIGGER] = "missed_trigger",
	[LEDGER_REPEATED] = "repeated",
	[LEDGER_LATE] = "late",
	[LEDGER_SHIFTED] = "shifted",
	[LEDGER_DOUBTFUL] = "doubtful",
	[LEDGER_RESTARTED] = "restarted",
	[LEDGER_COUNTER_JUMPED] = "counter_jumped",
	[LEDGER_PHASE_SLIPPED] = "phase_slipped",
	[LEDGER_SLOWER_THAN_TRIGGER] = "slower_than_trigger",
	[LEDGER_OUT_OF_STEP] = "out_of_step",
	[LEDGER_DARK] = "dark",
	[LEDGER_OVEREXPOSED] = "overexposed",
	[LEDGER_MOVED] = "moved",
	[LEDGER_CLOCK_STEPPED] = "clock_stepped",
};

const char *ledger_event_name(enum ledger_event event)
{
	return event < LEDGER_EVENT_COUNT ? names[event] : NULL;
}

void ledger_note(struct ledger_camera *camera, enum ledger_event event, uint64_t shot,
		 uint64_t count)
{
	camera->counts[event] += count;
	camera->event = event;
	camera->event_shot = shot;
}

/* The shot on the camera's grid (divider and phase) nearest to `shot`. */
static uint64_t on_grid(const struct ledger_camera *camera, uint64_t shot)
{
	uint64_t slip =
		(shot % camera->divider + camera->divider - camera->phase) % camera->divider;

	return slip <= camera->divider / 2 && slip <= shot ? shot - slip
							   : shot + (camera->divider - slip);
}

/* Sooner than was thought possible: what was known came from a camera that was late all the time.
 */
static void learn_arrival(struct judging *j)
{
	struct ledger_camera *camera = j->camera;

	if (ledger_too_soon_for(j, j->nearest))
		camera->arrivals = 0;
	int64_t took_ns = elapsed_ns(j->frame->mid_exposure_ns, j->frame->arrival_ns);
	int64_t off_ns = elapsed_ns(edges_time_ns(&j->ledger->edges, j->nearest), j->edge_time_ns);

	if (camera->arrivals == 0 || took_ns < camera->arrival_min_ns)
		camera->arrival_min_ns = took_ns;
	else
		camera->arrival_min_ns += j->ledger->edges.period_ns / ARRIVAL_LEAK_SHARE;
	camera->lag_ns += (off_ns - camera->lag_ns) / (camera->arrivals ? LAG_SHARE : 1);
	if (camera->arrivals < ARRIVALS_KNOWN)
		camera->arrivals++;
}

/* What an accepted frame says about its camera, and what is put right in it. */
static void finish(struct judging *j, uint64_t *shot, int64_t *mid_exposure_ns)
{
	struct ledger_camera *camera = j->camera;
	uint64_t taken = camera->line.shot;
	int64_t usual_ns = edges_time_ns(&j->ledger->edges, taken) + camera->lag_ns;
	bool learn = !ledger_is_settled(camera) ||
		     ledger_note_clock(j->ledger, (uint32_t)(camera - j->ledger->cameras), taken,
				       elapsed_ns(usual_ns, j->edge_time_ns));

	*shot = taken;
	*mid_exposure_ns = j->frame->mid_exposure_ns;
	if (taken != j->timed) {
		if (!ledger_time_allows(j, taken))
			*mid_exposure_ns = edges_time_ns(&j->ledger->edges, taken) +
					   camera->offset_ns + camera->lag_ns;
		return;
	}
	if (learn)
		learn_arrival(j);
	camera->slip = (uint32_t)((j->nearest % camera->divider + camera->divider - camera->phase) %
				  camera->divider);
	*shot = j->nearest;
	if (camera->slip)
		ledger_note(camera, LEDGER_PHASE_SLIPPED, j->nearest, 1);
}

enum ledger_verdict ledger_judge(struct ledger *ledger, uint32_t camera,
				 const struct ledger_frame *frame, bool final, uint64_t *shot,
				 int64_t *mid_exposure_ns)
{
	struct ledger_frame own = *frame;
	struct judging j = {.ledger = ledger, .camera = &ledger->cameras[camera], .frame = &own};

	own.mid_exposure_ns = elapsed_ns(j.camera->clock_off_ns, frame->mid_exposure_ns);
	j.edge_time_ns = elapsed_ns(j.camera->offset_ns, own.mid_exposure_ns);
	enum edges_found found = edges_nearest(&ledger->edges, j.edge_time_ns, &j.nearest);
	j.timed = on_grid(j.camera, j.nearest);
	if (!final && (!ledger->edges.added || (found == EDGES_LATER && !ledger_needs_no_edge(&j))))
		return LEDGER_WAIT;
	if (found == EDGES_NONE)
		return LEDGER_EARLY;
	enum ledger_verdict verdict = ledger_judge_by_line(&j);
	j.camera->seen_seq = frame->device_seq;
	j.camera->seen_mid_exposure_ns = own.mid_exposure_ns;
	if (verdict == LEDGER_TAKE)
		finish(&j, shot, mid_exposure_ns);
	return verdict;
}

enum ledger_verdict ledger_watch(struct ledger *ledger, uint32_t camera,
				 const struct ledger_frame *frame)
{
	struct ledger_camera *c = &ledger->cameras[camera];
	uint64_t shot = ledger->closed_any ? ledger->closed_shot + 1 : 0;
	uint64_t step = frame->device_seq - c->seen_seq;
	enum ledger_verdict verdict = LEDGER_TAKE;

	if (c->started && (step == 0 || frame->mid_exposure_ns == c->seen_mid_exposure_ns)) {
		ledger_note(c, LEDGER_REPEATED, shot, 1);
		verdict = LEDGER_REFUSE;
	} else if (c->started && goes_back(c->seen_seq, frame->device_seq)) {
		ledger_note(c, LEDGER_RESTARTED, shot, 1);
	} else if (c->started && step > 1 && step <= SEQ_GAP_MAX) {
		ledger_note(c, LEDGER_DROPPED, shot, step - 1);
	}
	c->started = true;
	c->seen_seq = frame->device_seq;
	c->seen_mid_exposure_ns = frame->mid_exposure_ns;
	return verdict;
}

void ledger_init(struct ledger *ledger, int64_t period_ns)
{
	memset(ledger, 0, sizeof(*ledger));
	ledger->edges.period_ns = period_ns;
	for (uint32_t c = 0; c < CAMERA_MAX; c++)
		ledger->cameras[c].divider = 1;
}

void ledger_set_camera(struct ledger *ledger, uint32_t camera, uint32_t divider, uint32_t phase,
		       int64_t offset_ns)
{
	ledger->cameras[camera].divider = divider;
	ledger->cameras[camera].phase = phase;
	ledger->cameras[camera].offset_ns = offset_ns;
	ledger->cameras[camera].never_late = true;
}

void ledger_close(struct ledger *ledger, uint64_t shot)
{
	ledger->closed_any = true;
	ledger->closed_shot = shot;
}
