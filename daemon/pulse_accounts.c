/*
 * The control thread's side of the trigger: what its pulses were like, and a trigger that was lost
 * and comes back.
 */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/log.h"
#include "daemon/pulses.h"

static void note_events(struct pulse_accounts *accounts, const struct edge *edge)
{
	for (uint32_t e = 0; e < PULSE_EVENT_COUNT; e++) {
		if (!(edge->events >> e & 1))
			continue;
		accounts->events[e]++;
		accounts->event = e;
		accounts->event_shot = edge->shot;
	}
}

static void tell_missed(const char *address, const struct edge *edge, uint64_t count)
{
	log_about(LOG_LEVEL_WARNING, &(struct log_fields){.shot = edge->shot - 1},
		  "trigger %s: nothing was fired in shots %" PRIu64 " to %" PRIu64 " (%" PRIu64
		  " missed in the last second); docs/faults.md says why that may be",
		  address, edge->shot - edge->missed, edge->shot - 1, count);
}

/* Each kind of event once; the accounts tell how often. */
static void tell_events(struct pulse_accounts *accounts, const char *address)
{
	for (uint32_t e = 0; e < PULSE_EVENT_COUNT; e++) {
		if (!accounts->events[e] || (accounts->told >> e & 1))
			continue;
		accounts->told |= UINT32_C(1) << e;
		log_about(LOG_LEVEL_WARNING, &(struct log_fields){.shot = accounts->event_shot},
			  "trigger %s: %s, about shot %" PRIu64
			  "; docs/faults.md says what that is, stagectl status counts it",
			  address, pulse_event_name((enum pulse_event)e), accounts->event_shot);
	}
}

/* A genlock that does not come, mostly; or the whole program stood still. */
static void watch_silence(struct pulses *pulses, bool any, const char *address)
{
	bool expected =
		pulses->armed && pulses->driver->reports_edges && !atomic_load(&pulses->lost);

	if (any || !expected)
		pulses->accounts.quiet_s = 0;
	else if (++pulses->accounts.quiet_s == PULSES_QUIET_S)
		log_warning("trigger %s: no pulse for %d s: %s", address, PULSES_QUIET_S,
			    strstr(address, "genlock=")
				    ? "is its genlock connected and running?"
				    : "was the station itself held up, or the machine overloaded?");
}

void pulses_account(struct pulses *pulses, const char *address)
{
	struct pulse_accounts *accounts = &pulses->accounts;
	uint64_t missed_before = accounts->missed;
	struct edge gap = {0};
	const struct edge *edge;

	if (!pulses->reports.items)
		return;
	watch_silence(pulses, ring_count(&pulses->reports) > 0, address);
	while ((edge = ring_peek(&pulses->reports, 0))) {
		histogram_add(&accounts->late, edge->late_ns);
		if (edge->missed) {
			accounts->missed += edge->missed;
			accounts->missed_shot = edge->shot - 1;
			gap = *edge;
		}
		note_events(accounts, edge);
		ring_pop(&pulses->reports);
	}
	if (gap.missed)
		tell_missed(address, &gap, accounts->missed - missed_before);
	tell_events(accounts, address);
}

struct trigger *pulses_give_up(struct pulses *pulses)
{
	struct trigger *trigger = pulses->trigger;

	pulses->trigger = NULL;
	pulses->armed = false;
	return trigger;
}

int pulses_take_back(struct pulses *pulses, struct trigger *trigger, bool run, struct diag *diag)
{
	pulses->trigger = trigger;
	pulses->renumber = true;
	int err = run ? pulses_start(pulses, diag) : 0;

	if (err)
		return err;
	pulses->lost_since_ns = 0;
	atomic_store(&pulses->lost, false);
	return 0;
}
