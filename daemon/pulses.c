/*
 * The trigger thread. It neither allocates, locks nor logs.
 */
#include "daemon/pulses.h"

#include <errno.h>
#include <string.h>

#include "base/clock_virtual.h"

#define NEXT_TIMEOUT_NS (100 * NS_PER_MS)
#define REPORTS_NS (2 * NS_PER_S) /* the control thread looks once a second */
#define REPORTS_MIN 16

/* A trigger that came back counts from 0: its shots go on by the time that has passed, on the same
 * grid of HD frames. */
static void number_on(struct pulses *pulses, const struct edge *edge)
{
	const struct trigger_plan *plan = &pulses->plan;
	uint64_t divider = (uint64_t)plan->hd_divider;
	int64_t passed_ns = edge->edge_ns - pulses->last.edge_ns;
	uint64_t periods = 1;

	if (passed_ns > plan->period_ns)
		periods = (uint64_t)((passed_ns + plan->period_ns / 2) / plan->period_ns);
	uint64_t shot = pulses->last.shot + periods;
	uint64_t first = shot > edge->shot ? shot - edge->shot : 0;

	pulses->first_shot = (first + divider - 1) / divider * divider;
}

static void number(struct pulses *pulses, struct edge *edge)
{
	if (pulses->renumber && pulses->any_edge) {
		number_on(pulses, edge);
		edge->missed = (uint32_t)(pulses->first_shot + edge->shot - pulses->last.shot - 1);
	}
	pulses->renumber = false;
	edge->shot += pulses->first_shot;
	pulses->last = *edge;
	pulses->any_edge = true;
}

static void report(struct pulses *pulses, const struct edge *edge)
{
	struct edge *slot = ring_claim(&pulses->reports);

	if (!slot)
		return; /* counted by the ring */
	*slot = *edge;
	ring_publish(&pulses->reports);
}

static void queue_edge(struct pulses *pulses, const struct edge *edge)
{
	struct edge *slot = ring_claim(&pulses->edges);

	atomic_fetch_add_explicit(&pulses->edges_count, 1, memory_order_relaxed);
	if (!slot) {
		atomic_fetch_add_explicit(&pulses->edges_refused, 1, memory_order_relaxed);
		return;
	}
	*slot = *edge;
	ring_publish(&pulses->edges);
	clock_semaphore_post(pulses->solver_wake);
}

static void run_pulses(void *argument)
{
	struct pulses *pulses = argument;
	int err = 0;

	while (!atomic_load_explicit(&pulses->stopping, memory_order_relaxed) &&
	       (err == 0 || err == -ETIMEDOUT)) {
		struct edge edge;

		heartbeat_beat(&pulses->thread.heartbeat);
		err = pulses->driver->next(pulses->trigger, NEXT_TIMEOUT_NS, &edge);
		if (err == 0) {
			number(pulses, &edge);
			report(pulses, &edge);
			queue_edge(pulses, &edge);
		}
	}
	if (err && err != -ETIMEDOUT) {
		atomic_store(&pulses->lost_error, err);
		atomic_store(&pulses->lost, true);
	}
	clock_semaphore_post(pulses->solver_wake);
}

int pulses_open(struct pulses *pulses, const char *address, const struct trigger_plan *plan,
		const struct trigger_driver *const *drivers, uint32_t queue_length,
		struct diag *diag)
{
	struct pulses opened = {.plan = *plan};
	const char *rest;

	opened.driver = trigger_driver_find(drivers, address, &rest, diag);
	if (!opened.driver)
		return -EINVAL;
	int err = opened.driver->open(&opened.trigger, rest, diag);
	if (err)
		return err;
	err = ring_init(&opened.edges, sizeof(struct edge), queue_length);
	if (!err)
		err = ring_init(&opened.reports, sizeof(struct edge),
				(uint32_t)(REPORTS_NS / plan->period_ns) + REPORTS_MIN);
	if (err) {
		pulses_close(&opened);
		return err;
	}
	*pulses = opened;
	return 0;
}

void pulses_close(struct pulses *pulses)
{
	if (pulses->trigger)
		pulses->driver->close(pulses->trigger);
	ring_finish(&pulses->edges);
	ring_finish(&pulses->reports);
	memset(pulses, 0, sizeof(*pulses));
}

void pulses_begin_run(struct pulses *pulses)
{
	ring_clear(&pulses->edges);
	ring_clear(&pulses->reports);
	memset(&pulses->accounts, 0, sizeof(pulses->accounts));
	pulses->any_edge = pulses->renumber = false;
	pulses->first_shot = 0;
	if (pulses->trigger)
		pulses->lost_since_ns = 0;
	atomic_store(&pulses->lost, !pulses->trigger);
	atomic_store(&pulses->edges_count, 0);
	atomic_store(&pulses->edges_refused, 0);
}

int pulses_start(struct pulses *pulses, struct diag *diag)
{
	if (!pulses->trigger) {
		diag_add(diag, "trigger: lost: %s", pulses->lost_why);
		return -ENODEV;
	}
	int err = pulses->driver->arm(pulses->trigger, &pulses->plan, diag);

	if (err)
		return err;
	pulses->armed = true;
	atomic_store(&pulses->stopping, false);
	if (!pulses->driver->reports_edges)
		return 0;
	pulses->thread.name = "trigger";
	pulses->thread.run = run_pulses;
	pulses->thread.argument = pulses;
	err = realtime_thread_start(&pulses->thread, PRIORITY_TRIGGER);
	if (err) {
		diag_add(diag, "trigger: cannot start its thread: %s", strerror(-err));
		pulses_stop(pulses);
		return err;
	}
	return 0;
}

bool pulses_stop(struct pulses *pulses)
{
	atomic_store(&pulses->stopping, true);
	bool ended = realtime_thread_join(&pulses->thread);

	if (pulses->armed)
		pulses->driver->disarm(pulses->trigger); /* dark, even if the thread hangs */
	pulses->armed = false;
	return ended;
}
