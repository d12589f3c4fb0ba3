/*
 * One load at a time; one rig waiting for the solver at a time.
 */
#include "daemon/rig_swap.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>

#include "base/clock_virtual.h"

static void live_rig_destroy(struct live_rig *rig)
{
	if (rig)
		rig_finish(&rig->rig);
	free(rig);
}

static void note_revision(struct rig_swap *swap, uint32_t serial, const char *revision)
{
	strcpy(swap->revisions[serial % RIG_REVISIONS], revision);
}

int rig_swap_init(struct rig_swap *swap, const struct stage *stage, int wake_fd)
{
	struct live_rig *first = calloc(1, sizeof(*first));

	if (!first)
		return -ENOMEM;
	*swap = (struct rig_swap){.stage = stage, .wake_fd = wake_fd, .current = first};
	first->serial = 1;
	first->tracking = stage->tracking;
	note_revision(swap, first->serial, stage->rig.revision);
	handover_init(&swap->handover, first);
	return 0;
}

void rig_swap_finish(struct rig_swap *swap)
{
	if (swap->loading) {
		pthread_join(swap->thread, NULL);
		live_rig_destroy(swap->loaded);
	}
	live_rig_destroy(swap->before);
	live_rig_destroy(swap->current);
	diag_finish(&swap->diag);
	memset(swap, 0, sizeof(*swap));
}

static void *load(void *argument)
{
	struct rig_swap *swap = argument;
	struct live_rig *rig = calloc(1, sizeof(*rig));

	swap->error =
		rig ? stage_load_rig_again(swap->stage, &rig->rig, &rig->tracking, &swap->diag)
		    : -ENOMEM;
	if (swap->error)
		free(rig);
	else
		swap->loaded = rig;
	atomic_store(&swap->done, true);
	eventfd_write(swap->wake_fd, 1);
	clock_release();
	return NULL;
}

int rig_swap_begin(struct rig_swap *swap)
{
	if (swap->loading || swap->before)
		return -EBUSY;
	diag_finish(&swap->diag);
	swap->loaded = NULL;
	atomic_store(&swap->done, false);
	clock_hold(); /* loading takes no virtual time */
	int err = -pthread_create(&swap->thread, NULL, load, swap);

	if (err)
		clock_release();
	swap->loading = !err;
	return err;
}

static void offer(struct rig_swap *swap)
{
	swap->before = swap->current;
	swap->current = swap->loaded;
	swap->current->serial = swap->before->serial + 1;
	note_revision(swap, swap->current->serial, swap->current->rig.revision);
	handover_offer(&swap->handover, swap->current);
}

enum rig_swap_state rig_swap_poll(struct rig_swap *swap, bool solver_runs)
{
	if (swap->loading) {
		if (!atomic_load(&swap->done))
			return RIG_SWAP_PENDING;
		pthread_join(swap->thread, NULL);
		swap->loading = false;
		if (swap->error)
			return RIG_SWAP_FAILED;
		offer(swap);
	}
	if (!swap->before)
		return RIG_SWAP_NONE;
	if (!solver_runs)
		handover_take(&swap->handover);
	if (!handover_settled(&swap->handover))
		return RIG_SWAP_PENDING;
	live_rig_destroy(swap->before);
	swap->before = NULL;
	return RIG_SWAP_DONE;
}

uint32_t rig_swap_number(const struct rig_swap *swap)
{
	return swap->current->serial == 1 ? swap->stage->rig.number : swap->current->rig.number;
}

const char *rig_swap_revision(const struct rig_swap *swap, uint32_t serial)
{
	return swap->revisions[serial % RIG_REVISIONS];
}
