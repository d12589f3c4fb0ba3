/*
 * When the machine itself stood still: an emulated one does, when its host has other things to do.
 * A thread that should wake every few milliseconds tells. What is timed meanwhile proves nothing.
 */
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#define STALLS_MAX 1000

struct stall_watch {
	pthread_t thread;
	atomic_bool ending;
	_Atomic int64_t longest_ns; /* since somebody set it to 0 */
	_Atomic uint32_t count;     /* of those longer than STALL_NS */
	struct {
		int64_t begin_ns, end_ns;
	} stalls[STALLS_MAX];
};

#define STALL_NS INT64_C(50000000)

/* Returns 0 or a negative errno. It stays where it is until the end. */
int stall_watch_begin(struct stall_watch *watch);
void stall_watch_end(struct stall_watch *watch);

/* Whether it did for longer than STALL_NS, at some time between these two. */
bool stall_watch_stood_still(const struct stall_watch *watch, int64_t from_ns, int64_t to_ns);
