/*
 * One immutable value that the control thread replaces while a real-time thread uses it. The
 * real-time thread takes the newest between two pieces of work; only when it has is the one before
 * it free to be destroyed. Neither side ever waits.
 */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>

struct handover {
	_Atomic(const void *) offered; /* control thread stores */
	_Atomic(const void *) taken;   /* the user's thread stores */
};

/* Control thread, before the user's thread runs. */
void handover_init(struct handover *handover, const void *first);

/* Control thread. False, and nothing is offered, while the last one has not been taken. */
bool handover_offer(struct handover *handover, const void *next);

/* Control thread: true when nothing but what was offered last is in use. */
bool handover_settled(const struct handover *handover);

/* The user's thread, or the control thread while that one does not run. Real-time safe. The pointer
 * stays valid until the next call. */
const void *handover_take(struct handover *handover);
