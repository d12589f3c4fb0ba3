/*
 * One thing at a time that may block for seconds, done on a thread of its own: the control thread
 * has subscribers to serve meanwhile. It takes no virtual time.
 */
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

struct errand {
	/* control thread */
	bool busy; /* until errand_poll() or errand_finish() says that it is over */
	pthread_t thread;
	/* set before the thread starts */
	void (*run)(void *user);
	void *user;

	_Atomic bool done; /* what `run` did is the control thread's from then on */
};

/* Calls run(user) on a thread. False, and nothing has happened, while busy and when there is no
 * thread to be had. */
bool errand_begin(struct errand *errand, void (*run)(void *user), void *user);

/* True once when it is over. */
bool errand_poll(struct errand *errand);

/* Waits for it, at most 0.5 s: a device that does not answer may take its driver seconds. False
 * when it goes on: then nothing that it uses may be freed. */
bool errand_finish(struct errand *errand);
