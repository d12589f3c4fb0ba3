/*
 * Release/acquire pairs order the value's bytes with the pointer that shows them, and the last use
 * of the old value with the word that it is over.
 */
#include "base/handover.h"

void handover_init(struct handover *handover, const void *first)
{
	atomic_store(&handover->offered, first);
	atomic_store(&handover->taken, first);
}

bool handover_offer(struct handover *handover, const void *next)
{
	if (!handover_settled(handover))
		return false;
	atomic_store_explicit(&handover->offered, next, memory_order_release);
	return true;
}

bool handover_settled(const struct handover *handover)
{
	return atomic_load_explicit(&handover->taken, memory_order_acquire) ==
	       atomic_load_explicit(&handover->offered, memory_order_relaxed);
}

const void *handover_take(struct handover *handover)
{
	const void *newest = atomic_load_explicit(&handover->offered, memory_order_acquire);

	if (newest != atomic_load_explicit(&handover->taken, memory_order_relaxed))
		atomic_store_explicit(&handover->taken, newest, memory_order_release);
	return newest;
}
