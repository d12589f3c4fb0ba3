/*
 * The solver thread. It neither allocates, locks nor logs.
 */
#include "daemon/solver.h"

#include <errno.h>
#include <string.h>
#include <sys/eventfd.h>

#include "base/clock_virtual.h"
#include "daemon/rig_swap.h"
#include "drivers/trigger_plan.h"
#include "track/shot.h"

/* A camera that is merely late shows up within a period; only a silent one takes the whole wait. */
#define DEADLINE_PERIODS 3
/* A camera that missed as many shots in a row is not waited for, until it sends again. */
#define SILENT_AFTER_SHOTS 12
#define IDLE_WAIT_NS (100 * NS_PER_MS)

/* The fronts of one look at all queues. */
struct fronts {
	const struct blob_set *sets[CAMERA_MAX];
	struct front cameras[CAMERA_MAX];
	struct front edge;
	int64_t deadline_ns; /* of the oldest front; INT64_MAX without any */
	bool all_ended;
};

static uint32_t camera_count(const struct solver *solver)
{
	return solver->stage->config.camera_count;
}

static void count(_Atomic uint64_t *counter, uint64_t more)
{
	atomic_fetch_add_explicit(counter, more, memory_order_relaxed);
}

/* Cameras that stay silent are fronts that ended, as long as another one still sends. */
static void pass_over_silent(const struct solver *solver, struct fronts *fronts)
{
	uint32_t silent = 0, others = 0;

	for (uint32_t c = 0; c < camera_count(solver); c++) {
		if (fronts->cameras[c].state == FRONT_ENDED)
			continue;
		bool is_silent = fronts->cameras[c].state == FRONT_WAITING &&
				 solver->missed_in_a_row[c] >= SILENT_AFTER_SHOTS;
		*(is_silent ? &silent : &others) |= UINT32_C(1) << c;
	}
	for (uint32_t left = others ? silent : 0; left; left &= left - 1)
		fronts->cameras[__builtin_ctz(left)].state = FRONT_ENDED;
}

static int64_t earlier(int64_t a_ns, int64_t b_ns)
{
	return a_ns < b_ns ? a_ns : b_ns;
}

/* When the oldest of the fronts came, or the oldest edge asked for its light. */
static int64_t oldest_ns(struct solver *solver, const struct front *edge)
{
	int64_t oldest = edge->state == FRONT_READY ? edge->mid_exposure_ns : INT64_MAX;

	for (uint32_t c = 0; c < camera_count(solver); c++) {
		const struct blob_set *set = solver->captures[c].role == ROLE_IR
						     ? ring_peek(&solver->captures[c].sets, 0)
						     : NULL;

		if (set)
			oldest = earlier(oldest, set->found_ns);
	}
	return oldest;
}

static void look_at_camera(struct solver *solver, struct fronts *fronts, uint32_t c, bool expired)
{
	struct capture *capture = &solver->captures[c];
	/* the state before the queue: what was queued before the end is still seen */
	bool ended = atomic_load(&capture->state) != CAPTURE_RUNNING || capture->role != ROLE_IR;

	fronts->sets[c] = NULL;
	fronts->cameras[c] = capture->role == ROLE_IR
				     ? shot_book_front(&solver->book, capture, c, ended, expired,
						       &fronts->sets[c])
				     : front_of_queue(NULL, true);
	if (fronts->sets[c])
		solver->missed_in_a_row[c] = 0; /* late is not silent */
	if (fronts->sets[c] || !ended)
		fronts->all_ended = false;
}

static void look(struct solver *solver, struct fronts *fronts, int64_t now_ns)
{
	fronts->all_ended = true;
	fronts->edge = (struct front){.state = FRONT_ENDED};
	if (solver->pulses)
		fronts->edge = shot_book_edge(&solver->book);
	int64_t oldest = oldest_ns(solver, &fronts->edge);
	fronts->deadline_ns = oldest == INT64_MAX ? INT64_MAX : oldest + solver->deadline_ns;
	for (uint32_t c = 0; c < camera_count(solver); c++)
		look_at_camera(solver, fronts, c, now_ns >= fronts->deadline_ns);
	pass_over_silent(solver, fronts);
}

static void count_cameras(struct solver *solver, const struct shot *shot)
{
	for (uint32_t c = 0; c < camera_count(solver); c++) {
		if (!(shot->missing_mask >> c & 1)) {
			solver->missed_in_a_row[c] = 0;
			continue;
		}
		solver->missed_in_a_row[c]++;
		count(&solver->captures[c].counters.missing, 1);
	}
	count(&solver->shots, 1);
	count(&solver->incomplete, shot->missing_mask != 0);
}

static void stamp(struct marker_set *set, const struct shot *shot)
{
	set->arrival_ns = set->found_ns = 0;
	for (uint32_t c = 0; c < shot->camera_count; c++) {
		const struct blob_set *blobs = shot->sets[c];

		if (blobs && blobs->arrival_ns > set->arrival_ns)
			set->arrival_ns = blobs->arrival_ns;
		if (blobs && blobs->found_ns > set->found_ns)
			set->found_ns = blobs->found_ns;
	}
	set->solved_ns = clock_now_ns();
}

/* A full queue towards the control thread loses the set; the shot then counts as lost. */
static void track(struct solver *solver, const struct sync_decision *decision,
		  const struct fronts *fronts)
{
	struct shot shot;

	shot_gather(&shot, decision, fronts->sets, camera_count(solver), solver->stage->ir_mask);
	if (!solver->run.solve) {
		shot_book_close(&solver->book, &solver->rig->tracking, &shot, NULL);
		count_cameras(solver, &shot);
		return;
	}
	struct marker_set *set = ring_claim(&solver->sets);
	if (!set) {
		shot_book_close(&solver->book, &solver->rig->tracking, &shot, NULL);
		count(&solver->lost, 1);
		return;
	}
	tracker_run(&solver->tracker, solver->scratch, &solver->rig->tracking, &shot, set);
	shot_book_close(&solver->book, &solver->rig->tracking, &shot, set);
	stamp(set, &shot);
	hd_plan_stamp(&solver->hd, set);
	set->run = solver->run.number;
	set->rig_serial = solver->rig->serial;
	shot_copy_take(solver->shot_copy, &shot, set);
	clock_hold(); /* until station_pop_set() */
	ring_publish(&solver->sets);
	eventfd_write(solver->control_wake_fd, 1);
	count_cameras(solver, &shot);
}

static void consume(struct solver *solver, const struct sync_decision *decision)
{
	for (uint32_t c = 0; c < camera_count(solver); c++) {
		uint32_t bit = UINT32_C(1) << c;

		if ((decision->member_mask | decision->stale_mask) & bit) {
			ring_pop(&solver->captures[c].sets);
			shot_book_taken(&solver->book, c);
		}
		count(&solver->captures[c].counters.stale, (decision->stale_mask & bit) != 0);
		count(&solver->captures[c].counters.wrong_time,
		      (decision->off_time_mask & bit) != 0);
		if ((decision->stale_mask & bit) && !solver->pulses)
			shot_book_late(&solver->book, c, solver->sync.last_shot);
	}
	if (decision->edge_used)
		shot_book_edge_used(&solver->book);
}

static void place_hd_frames(struct solver *solver)
{
	for (uint32_t left = solver->hd.camera_mask; left; left &= left - 1) {
		uint32_t camera = (uint32_t)__builtin_ctz(left);
		struct capture *capture = &solver->captures[camera];

		count(&capture->counters.before_start,
		      hd_capture_place(&capture->hd, &solver->hd, &solver->sync,
				       solver->pulses ? &solver->book : NULL, camera));
	}
}

/* Between two shots. A new rig may be another stage frame: nothing that was tracked holds in it. */
static void take_rig(struct solver *solver)
{
	const struct live_rig *newest = handover_take(solver->rigs);

	if (newest == solver->rig)
		return;
	solver->rig = newest;
	tracker_state_init(&solver->tracker, &solver->stage->layout);
	eventfd_write(solver->control_wake_fd, 1); /* the old one may be freed */
}

/* One step; false when there is nothing to do but wait, at most until `*wake_ns`. */
static bool solve_next(struct solver *solver, int64_t *wake_ns)
{
	struct sync_decision decision;
	struct fronts fronts;
	bool had_shot = solver->sync.started;
	uint64_t last_shot = solver->sync.last_shot;
	int64_t now_ns = clock_now_ns();

	*wake_ns = now_ns + IDLE_WAIT_NS;
	take_rig(solver);
	place_hd_frames(solver);
	if (!solver->pulses && !warm_up_step(&solver->warm_up, solver->captures,
					     camera_count(solver), solver->sync.period_ns, now_ns))
		return false;
	look(solver, &fronts, now_ns);
	enum sync_result result = sync_next(&solver->sync, fronts.cameras, camera_count(solver),
					    solver->pulses ? &fronts.edge : NULL,
					    now_ns >= fronts.deadline_ns, &decision);
	atomic_store_explicit(&solver->all_ended, fronts.all_ended, memory_order_relaxed);
	if (result == SYNC_SHOT) {
		if (had_shot)
			count(&solver->lost, decision.shot - last_shot - 1);
		track(solver, &decision, &fronts);
	}
	consume(solver, &decision);
	if (now_ns < fronts.deadline_ns)
		*wake_ns = earlier(*wake_ns, fronts.deadline_ns);
	if (result == SYNC_END && fronts.edge.state == FRONT_READY) { /* pulses for nobody */
		shot_book_edge_used(&solver->book);
		return true;
	}
	return result == SYNC_SHOT || result == SYNC_STALE;
}

static void run_solver(void *argument)
{
	struct solver *solver = argument;

	while (!atomic_load_explicit(&solver->stopping, memory_order_relaxed)) {
		int64_t wake_ns;

		heartbeat_beat(&solver->thread.heartbeat);
		if (solve_next(solver, &wake_ns))
			continue;
		tracker_prepare(&solver->tracker, solver->scratch, &solver->rig->tracking);
		clock_semaphore_wait(&solver->wake, wake_ns);
	}
}

int solver_init(struct solver *solver, const struct stage *stage, struct handover *rigs,
		struct capture *captures, struct pulses *pulses, struct shot_copy *shot_copy,
		int control_wake_fd, uint32_t queue_length)
{
	memset(solver, 0, sizeof(*solver));
	solver->stage = stage;
	solver->rigs = rigs;
	solver->captures = captures;
	solver->pulses = pulses;
	solver->shot_copy = shot_copy;
	solver->control_wake_fd = control_wake_fd;
	int err = tracker_scratch_create(&solver->scratch);
	if (!err)
		err = ring_init(&solver->sets, sizeof(struct marker_set), queue_length);
	if (err) {
		solver_finish(solver);
		return err;
	}
	clock_semaphore_init(&solver->wake);
	return 0;
}

void solver_finish(struct solver *solver)
{
	tracker_scratch_destroy(solver->scratch);
	for (; solver->sets.items && ring_peek(&solver->sets, 0); ring_pop(&solver->sets))
		clock_release();
	ring_finish(&solver->sets);
	memset(solver, 0, sizeof(*solver));
}

/* Without a trigger of ours HD cameras expose when they do; the first frame tells the phase. */
static struct hd_plan hd_plan_of(const struct solver *solver)
{
	const struct trigger_plan *plan = solver->run.plan;
	uint32_t all = (uint32_t)((UINT64_C(1) << camera_count(solver)) - 1);
	struct hd_plan hd = {.camera_mask = all & ~solver->stage->ir_mask,
			     .divider = (uint32_t)plan->hd_divider};

	if (solver->pulses) {
		hd.phase = (uint32_t)plan->hd_phase;
		hd.phase_known = true;
		hd.after_ir_ns = trigger_plan_hd_middle_ns(plan) - trigger_plan_ir_middle_ns(plan);
	}
	return hd;
}

static void begin_book(struct solver *solver)
{
	shot_book_begin(&solver->book, solver->pulses, solver->run.period_ns);
	for (uint32_t left = solver->hd.camera_mask; left; left &= left - 1)
		ledger_set_camera(&solver->book.ledger, (uint32_t)__builtin_ctz(left),
				  solver->hd.divider, solver->hd.phase, solver->hd.after_ir_ns);
}

void solver_begin_run(struct solver *solver, const struct solver_run *run)
{
	solver->run = *run;
	solver->deadline_ns = DEADLINE_PERIODS * run->period_ns;
	solver->warm_up = (struct warm_up){0};
	solver->sync = (struct sync){.period_ns = run->period_ns};
	solver->hd = hd_plan_of(solver);
	solver->rig = handover_take(solver->rigs);
	begin_book(solver);
	tracker_state_init(&solver->tracker, &solver->stage->layout);
	memset(solver->missed_in_a_row, 0, sizeof(solver->missed_in_a_row));
	atomic_store(&solver->stopping, false);
	atomic_store(&solver->all_ended, false);
	atomic_store(&solver->shots, 0);
	atomic_store(&solver->incomplete, 0);
	atomic_store(&solver->lost, 0);
}

int solver_start(struct solver *solver, struct diag *diag)
{
	atomic_store(&solver->stopping, false);
	solver->thread.name = "solver";
	solver->thread.run = run_solver;
	solver->thread.argument = solver;
	int err = realtime_thread_start(&solver->thread, PRIORITY_SOLVER);

	if (err)
		diag_add(diag, "solver: cannot start its thread: %s", strerror(-err));
	return err;
}

bool solver_stop(struct solver *solver)
{
	if (!solver->thread.joinable)
		return true;
	atomic_store(&solver->stopping, true);
	clock_semaphore_post(&solver->wake);
	return realtime_thread_join(&solver->thread);
}
