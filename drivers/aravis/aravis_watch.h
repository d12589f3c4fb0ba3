/*
 * Notices that a GigE Vision camera is gone sooner than Aravis does, which goes on asking for five
 * seconds: a thread that looks now and then whether frames come, and asks the camera when none do.
 */
#pragma once

#include <netinet/in.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

struct aravis_watch {
	/* set before the thread starts */
	struct in_addr ip;
	const _Atomic uint32_t *frames; /* grows while frames come */
	void (*gone)(void *user);       /* once, on the watch's thread */
	void (*look)(void *user);       /* there too: now and then, while the camera is there */
	void *user;
	bool running;

	pthread_t thread;
	sem_t ending;
};

/* `watch` with ip, frames, gone, look and user set stays where it is until finish. Returns 0 or a
 * negative errno. Control thread. */
int aravis_watch_init(struct aravis_watch *watch);
void aravis_watch_finish(struct aravis_watch *watch); /* a zeroed one is fine */
