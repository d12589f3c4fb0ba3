/*
 * What is physically possible: no frame arrives before its exposure, nor sooner than this camera's
 * frames ever did, and its time is not off by a whole pulse.
 */
#include "track/sync/ledger_parts.h"

/* From the exposure of that shot to the frame's arrival. */
static int64_t delay_ns(const struct judging *j, uint64_t shot)
{
	int64_t exposed_ns = edges_time_ns(&j->ledger->edges, shot);
	int64_t arrival_ns = elapsed_ns(j->camera->offset_ns, j->frame->arrival_ns);

	return elapsed_ns(exposed_ns, arrival_ns);
}

bool ledger_too_soon_for(const struct judging *j, uint64_t shot)
{
	const struct ledger_camera *camera = j->camera;
	int64_t period_ns = j->ledger->edges.period_ns, took_ns = delay_ns(j, shot);

	return took_ns < -period_ns / 8 || (camera->arrivals >= ARRIVALS_KNOWN &&
					    took_ns < camera->arrival_min_ns - period_ns / 2);
}

bool ledger_arrives_as(const struct judging *j, uint64_t shot)
{
	return !ledger_too_soon_for(j, shot) &&
	       delay_ns(j, shot) < j->camera->arrival_min_ns + j->ledger->edges.period_ns / 2;
}

bool ledger_is_settled(const struct ledger_camera *camera)
{
	return camera->arrivals >= ARRIVALS_KNOWN && camera->line.count >= REBASE_FRAMES &&
	       camera->rival.count == 0;
}

bool ledger_needs_no_edge(const struct judging *j)
{
	const struct ledger_line *line = &j->camera->line;
	uint64_t step = j->frame->device_seq - line->seq;
	uint64_t counted = line->shot + step * line->stride;

	if (!ledger_is_settled(j->camera) || step == 0 || step > SEQ_GAP_MAX)
		return false;
	return counted == j->timed || (counted < j->timed && ledger_too_soon_for(j, j->timed) &&
				       ledger_arrives_as(j, counted));
}

bool ledger_time_allows(const struct judging *j, uint64_t shot)
{
	int64_t apart_ns = elapsed_ns(edges_time_ns(&j->ledger->edges, shot), j->edge_time_ns);
	int64_t limit_ns = j->ledger->edges.period_ns / 4 * 3;

	return apart_ns <= limit_ns && apart_ns >= -limit_ns;
}
