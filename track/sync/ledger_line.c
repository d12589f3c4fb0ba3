/*
 * A camera's counter and the shots of its frames lie on a line: each count is `stride` shots. A
 * frame that lies on it and is near its pulse is taken. One that does not is measured against what
 * is physically possible: no frame arrives before its exposure, no counter runs back, no camera
 * exposes twice on one pulse. What then still has two readings is refused, until enough frames in a
 * row agree on another line.
 */
#include "track/sync/ledger_parts.h"

#define SILENT_SHOTS 24 /* after as long the counter proves nothing */
#define STRIDE_MAX 8
#define SLOWER_FRAMES 12

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
		ledger_note(camera, LEDGER_SLOWER_THAN_TRIGGER, shot, 1);
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
	ledger_note(camera, LEDGER_LATE, shot, 1);
	return LEDGER_REFUSE;
}

static enum ledger_verdict refuse(struct judging *j, enum ledger_event event)
{
	ledger_note(j->camera, event, j->timed, 1);
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
		return camera->line.count < REBASE_FRAMES && ledger_too_soon_for(j, j->counted);
	if (camera->returned + 1 >= REBASE_FRAMES)
		return false;
	return rival->count > 1 || rival->shot >= j->counted ||
	       ledger_too_soon_for(j, j->counted) ||
	       (camera->arrivals >= ARRIVALS_KNOWN && !ledger_arrives_as(j, j->counted));
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
		ledger_note(j->camera, LEDGER_DROPPED, first_behind_line(j), missing);
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
		ledger_note(camera, LEDGER_MISSED_TRIGGER, first_behind_line(j),
			    (j->timed - j->counted) / camera->divider);
	else if (same_pace)
		ledger_note(camera, LEDGER_COUNTER_JUMPED, j->timed, 1);
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

	if (ledger_too_soon_for(j, j->timed))
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
	if (!ledger_is_settled(camera) || !ledger_arrives_as(j, j->counted))
		return doubt(j);
	ledger_note(camera, LEDGER_SHIFTED, j->counted, 1);
	return accept(j, j->counted);
}

static enum ledger_verdict judge_disagreement(struct judging *j)
{
	struct ledger_camera *camera = j->camera;
	const struct ledger_line *line = &camera->line;
	uint64_t apart = j->timed > line->shot ? j->timed - line->shot : 0;

	if (j->has_counted && j->counted < j->timed && ledger_is_settled(camera) &&
	    ledger_too_soon_for(j, j->timed) && ledger_arrives_as(j, j->counted)) {
		ledger_note(camera, LEDGER_SHIFTED, j->counted, 1);
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

enum ledger_verdict ledger_judge_by_line(struct judging *j)
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
		ledger_note(camera, LEDGER_RESTARTED, j->timed, 1);
		return begin(j, camera->divider);
	}
	j->seq_step = j->frame->device_seq - line->seq;
	j->has_counted = j->seq_step <= SEQ_GAP_MAX;
	j->counted = line->shot;
	if (j->has_counted)
		j->counted =
			edges_count_on(&j->ledger->edges, line->shot, j->seq_step, line->stride);
	if (j->has_counted && (j->counted == j->timed || ledger_time_allows(j, j->counted)))
		return accept_on_line(j);
	return judge_disagreement(j);
}
