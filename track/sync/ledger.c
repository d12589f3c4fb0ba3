/*
 * A camera's counter and the shots of its frames lie on a line: each count is `stride` shots. A
 * frame that lies on it and is near its pulse is taken. One that does not is measured against what
 * is physically possible: no frame arrives before its exposure, no counter runs back, no camera
 * exposes twice on one pulse. What then still has two readings is refused, until enough frames in a
 * row agree on another line.
 */
#include "track/sync/ledger.h"

#include <string.h>

#define REBASE_FRAMES 4     /* in a row on another line, until that is the camera's */
#define SILENT_SHOTS 24     /* after as long the counter proves nothing */
#define SEQ_GAP_MAX 1000000 /* a larger step is not a count of frames */
#define STRIDE_MAX 8
#define SLOWER_FRAMES 12
#define LAG_SHARE 16
#define ARRIVALS_KNOWN 120        /* before, the least time to arrival proves nothing */
#define ARRIVAL_LEAK_SHARE 100000 /* of a period and frame: 10 us/s at most */

/* One frame while it is judged. */
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

static void note(struct ledger_camera *camera, enum ledger_event event, uint64_t shot,
		 uint64_t count)
{
	camera->counts[event] += count;
	camera->event = event;
	camera->event_shot = shot;
}

static int64_t elapsed_ns(int64_t from_ns, int64_t to_ns)
{
	int64_t difference_ns;

	if (__builtin_sub_overflow(to_ns, from_ns, &difference_ns))
		return to_ns > from_ns ? INT64_MAX : INT64_MIN;
	return difference_ns;
}

static bool goes_back(uint64_t from_seq, uint64_t to_seq)
{
	return (int64_t)(to_seq - from_seq) < 0;
}

/* The shot on the camera's grid (divider and phase) nearest to `shot`. */
static uint64_t on_grid(const struct ledger_camera *camera, uint64_t shot)
{
	uint64_t slip =
		(shot % camera->divider + camera->divider - camera->phase) % camera->divider;

	return slip <= camera->divider / 2 && slip <= shot ? shot - slip
							   : shot + (camera->divider - slip);
}

/* From the exposure of that shot to the frame's arrival. */
static int64_t delay_ns(const struct judging *j, uint64_t shot)
{
	int64_t exposed_ns = edges_time_ns(&j->ledger->edges, shot);
	int64_t arrival_ns = elapsed_ns(j->camera->offset_ns, j->frame->arrival_ns);

	return elapsed_ns(exposed_ns, arrival_ns);
}

/* A frame of that shot would have come before it could. */
static bool too_soon_for(const struct judging *j, uint64_t shot)
{
	const struct ledger_camera *camera = j->camera;
	int64_t period_ns = j->ledger->edges.period_ns, took_ns = delay_ns(j, shot);

	return took_ns < -period_ns / 8 || (camera->arrivals >= ARRIVALS_KNOWN &&
					    took_ns < camera->arrival_min_ns - period_ns / 2);
}

/* It comes as soon as a frame of that shot usually does. */
static bool arrives_as(const struct judging *j, uint64_t shot)
{
	return !too_soon_for(j, shot) &&
	       delay_ns(j, shot) < j->camera->arrival_min_ns + j->ledger->edges.period_ns / 2;
}

/* Its line is beyond dispute, and so is how soon its frames can arrive. */
static bool is_settled(const struct ledger_camera *camera)
{
	return camera->arrivals >= ARRIVALS_KNOWN && camera->line.count >= REBASE_FRAMES &&
	       camera->rival.count == 0;
}

/* The counter of a settled camera says what its time says, or what its arrival does where the time
 * cannot be true: a pulse that is still to be reported could but agree. Else it may tell of pulses
 * that were not fired. */
static bool needs_no_edge(const struct judging *j)
{
	const struct ledger_line *line = &j->camera->line;
	uint64_t step = j->frame->device_seq - line->seq;
	uint64_t counted = line->shot + step * line->stride;

	if (!is_settled(j->camera) || step == 0 || step > SEQ_GAP_MAX)
		return false;
	return counted == j->timed ||
	       (counted < j->timed && too_soon_for(j, j->timed) && arrives_as(j, counted));
}

/* At the margin between two pulses the time leaves the choice to the counter. */
static bool time_allows(const struct judging *j, uint64_t shot)
{
	int64_t apart_ns = elapsed_ns(edges_time_ns(&j->ledger->edges, shot), j->edge_time_ns);
	int64_t limit_ns = j->ledger->edges.period_ns / 4 * 3;

	return apart_ns <= limit_ns && apart_ns >= -limit_ns;
}

/* Sooner than was thought possible: what was known came from a camera that was late all the time.
 */
static void learn_arrival(struct judging *j)
{
	struct ledger_camera *camera = j->camera;

	if (too_soon_for(j, j->nearest))
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

/* Every second shot only, again and again. */
static void watch_pace(struct ledger_camera *camera, uint64_t shot)
{
	uint64_t gap = (shot - camera->line.shot) / camera->divider;

	if (gap == 0 || gap > STRIDE_MAX)
		return;
	camera->gap_run = gap == camera->gap ? camera->gap_run + 1 : 1;
	camera->gap = (uint32_t)gap;
	if (camera->gap_run < SLOWER_FRAMES)
		return;
	camera->gap_run = SLOWER_FRAMES;
	if (gap > 1 && !camera->slower)
		note(camera, LEDGER_SLOWER_THAN_TRIGGER, shot, 1);
	camera->slower = gap > 1;
}

/* The frame is of `shot` on the grid; it lies on the camera's line from here on. */
static enum ledger_verdict accept(struct judging *j, uint64_t shot)
{
	struct ledger_camera *camera = j->camera;
	struct ledger_line *line = &camera->line;

	if (camera->started)
		watch_pace(camera, shot);
	camera->started = true;
	line->seq = j->frame->device_seq;
	line->shot = shot;
	if (line->count < REBASE_FRAMES)
		line->count++;
	camera->rival.count = 0;
	camera->repeat_counted = false;
	camera->refused_run = 0;
	camera->returned = 0;
	if (camera->never_late || !j->ledger->closed_any || shot > j->ledger->closed_shot)
		return LEDGER_TAKE;
	note(camera, LEDGER_LATE, shot, 1);
	return LEDGER_REFUSE;
}

static enum ledger_verdict refuse(struct judging *j, enum ledger_event event)
{
	note(j->camera, event, j->timed, 1);
	if (j->frame->device_seq != j->camera->seen_seq)
		j->camera->refused_run++;
	return LEDGER_REFUSE;
}

/* In a dispute one frame on the old line may be chance: a stamp that is off by what was missed.
 * Then it comes when another shot's frame would. Enough of them in a row are no chance. */
static bool may_be_chance(const struct judging *j)
{
	const struct ledger_camera *camera = j->camera;
	const struct ledger_line *rival = &camera->rival;

	if (rival->count == 0)
		return camera->line.count < REBASE_FRAMES && too_soon_for(j, j->counted);
	if (camera->returned + 1 >= REBASE_FRAMES)
		return false;
	return rival->count > 1 || rival->shot >= j->counted || too_soon_for(j, j->counted) ||
	       (camera->arrivals >= ARRIVALS_KNOWN && !arrives_as(j, j->counted));
}

/* The first shot that the camera should have been in behind its line's last frame. */
static uint64_t first_behind_line(const struct judging *j)
{
	const struct ledger_line *line = &j->camera->line;

	return edges_count_on(&j->ledger->edges, line->shot, 1, line->stride);
}

static enum ledger_verdict accept_on_line(struct judging *j)
{
	if (may_be_chance(j)) {
		j->camera->rival.count = j->camera->rival.count > 0;
		j->camera->returned++;
		return refuse(j, LEDGER_DOUBTFUL);
	}
	uint64_t missing = j->seq_step - 1 - j->camera->refused_run;

	if (j->seq_step > 1 + (uint64_t)j->camera->refused_run)
		note(j->camera, LEDGER_DROPPED, first_behind_line(j), missing);
	return accept(j, j->counted);
}

/* A new line through this frame. */
static enum ledger_verdict begin(struct judging *j, uint32_t stride)
{
	j->camera->line.stride = stride;
	j->camera->line.count = 0;
	return accept(j, j->timed);
}

/* The other line has proved right. Names what must have happened between the two. */
static enum ledger_verdict rebase(struct judging *j, uint32_t stride)
{
	struct ledger_camera *camera = j->camera;
	bool same_pace = stride == camera->line.stride;

	if (same_pace && j->has_counted && j->counted < j->timed)
		note(camera, LEDGER_MISSED_TRIGGER, first_behind_line(j),
		     (j->timed - j->counted) / camera->divider);
	else if (same_pace)
		note(camera, LEDGER_COUNTER_JUMPED, j->timed, 1);
	uint32_t agreed = camera->rival.count;
	enum ledger_verdict verdict = begin(j, stride);

	if (agreed > camera->line.count)
		camera->line.count = agreed; /* as sure as the frames that proved it */
	return verdict;
}

/* Shots per count from the rival's last frame to this one; 0 when they are on no line. */
static uint32_t stride_from_rival(const struct judging *j)
{
	const struct ledger_line *rival = &j->camera->rival;
	uint64_t counts = j->frame->device_seq - rival->seq, shots = j->timed - rival->shot;

	if (rival->count == 0 || counts == 0 || counts > SEQ_GAP_MAX || j->timed <= rival->shot ||
	    shots % (counts * j->camera->divider) != 0)
		return 0;
	uint64_t stride = shots / counts;
	if (stride > STRIDE_MAX * (uint64_t)j->camera->divider ||
	    (rival->count > 1 && stride != rival->stride))
		return 0;
	return (uint32_t)stride;
}

/* Counter and time disagree and no rule decides: frames that agree among themselves will. */
static enum ledger_verdict doubt(struct judging *j)
{
	struct ledger_line *rival = &j->camera->rival;
	uint32_t stride = stride_from_rival(j);
	uint32_t needed = j->camera->line.count + 1;

	if (too_soon_for(j, j->timed))
		return refuse(j, LEDGER_DOUBTFUL); /* its time proves nothing */
	if (needed < 2)
		needed = 2;
	if (needed > REBASE_FRAMES)
		needed = REBASE_FRAMES;
	j->camera->returned = 0;
	rival->count = stride ? rival->count + 1 : 1;
	rival->stride = stride;
	rival->seq = j->frame->device_seq;
	rival->shot = j->timed;
	if (stride && rival->count >= needed)
		return rebase(j, stride);
	return refuse(j, LEDGER_DOUBTFUL);
}

/* The device counted one frame more while the time stood: a stamp that is behind, or the same image
 * once more. */
static enum ledger_verdict judge_standing_time(struct judging *j)
{
	struct ledger_camera *camera = j->camera;

	if (j->frame->mid_exposure_ns == camera->seen_mid_exposure_ns) {
		camera->repeat_counted = true;
		return refuse(j, LEDGER_REPEATED);
	}
	if (!is_settled(camera) || !arrives_as(j, j->counted))
		return doubt(j);
	note(camera, LEDGER_SHIFTED, j->counted, 1);
	return accept(j, j->counted);
}

static enum ledger_verdict judge_disagreement(struct judging *j)
{
	struct ledger_camera *camera = j->camera;
	const struct ledger_line *line = &camera->line;
	uint64_t apart = j->timed > line->shot ? j->timed - line->shot : 0;

	if (j->has_counted && j->counted < j->timed && is_settled(camera) &&
	    too_soon_for(j, j->timed) && arrives_as(j, j->counted)) {
		note(camera, LEDGER_SHIFTED, j->counted, 1);
		return accept(j, j->counted);
	}
	if (!j->has_counted || apart > (uint64_t)SILENT_SHOTS * camera->divider)
		return apart ? rebase(j, line->stride) : doubt(j);
	if (j->seq_step == 1 && apart == 0)
		return judge_standing_time(j);
	if (camera->repeat_counted && j->counted == j->timed + line->stride)
		return begin(j, line->stride); /* the repeat was counted, and named */
	return doubt(j);
}

static enum ledger_verdict judge_by_line(struct judging *j)
{
	struct ledger_camera *camera = j->camera;
	const struct ledger_line *line = &camera->line;

	if (!camera->started)
		return begin(j, camera->divider);
	if (j->frame->device_seq == camera->seen_seq)
		return refuse(j, LEDGER_REPEATED);
	if (goes_back(line->seq, j->frame->device_seq)) {
		if (j->timed <= line->shot)
			return refuse(j, LEDGER_REPEATED);
		note(camera, LEDGER_RESTARTED, j->timed, 1);
		return begin(j, camera->divider);
	}
	j->seq_step = j->frame->device_seq - line->seq;
	j->has_counted = j->seq_step <= SEQ_GAP_MAX;
	j->counted = line->shot;
	if (j->has_counted)
		j->counted =
			edges_count_on(&j->ledger->edges, line->shot, j->seq_step, line->stride);
	if (j->has_counted && (j->counted == j->timed || time_allows(j, j->counted)))
		return accept_on_line(j);
	return judge_disagreement(j);
}

/* What an accepted frame says about its camera, and what is put right in it. */
static void finish(struct judging *j, uint64_t *shot, int64_t *mid_exposure_ns)
{
	struct ledger_camera *camera = j->camera;
	uint64_t taken = camera->line.shot;
	int64_t usual_ns = edges_time_ns(&j->ledger->edges, taken) + camera->lag_ns;
	bool learn = !is_settled(camera) ||
		     ledger_note_clock(j->ledger, (uint32_t)(camera - j->ledger->cameras), taken,
				       elapsed_ns(usual_ns, j->edge_time_ns));

	*shot = taken;
	*mid_exposure_ns = j->frame->mid_exposure_ns;
	if (taken != j->timed) {
		if (!time_allows(j, taken))
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
		note(camera, LEDGER_PHASE_SLIPPED, j->nearest, 1);
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
	if (!final && (!ledger->edges.added || (found == EDGES_LATER && !needs_no_edge(&j))))
		return LEDGER_WAIT;
	if (found == EDGES_NONE)
		return LEDGER_EARLY;
	enum ledger_verdict verdict = judge_by_line(&j);
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
		note(c, LEDGER_REPEATED, shot, 1);
		verdict = LEDGER_REFUSE;
	} else if (c->started && goes_back(c->seen_seq, frame->device_seq)) {
		note(c, LEDGER_RESTARTED, shot, 1);
	} else if (c->started && step > 1 && step <= SEQ_GAP_MAX) {
		note(c, LEDGER_DROPPED, shot, step - 1);
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
