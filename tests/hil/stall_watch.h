/*
 * How long the machine itself stood still: an emulated one does, when its host has other things to
 * do. A thread that should wake every few milliseconds tells.
 */
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>

struct stall_watch {
	pthread_t thread;
	atomic_bool ending;
	_Atomic int64_t longest_ns;
};

/* Returns 0 or a negative errno. It stays where it is until the end. */
int stall_watch_begin(struct stall_watch *watch);
int64_t stall_watch_end(struct stall_watch *watch); /* the longest */
