/*
 * Time: nanoseconds of the one clock that the station lives by. That is CLOCK_MONOTONIC, or, for
 * tests on simulated cameras, virtual time (clock_virtual.h), chosen before threads start.
 */
#pragma once

#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#define NS_PER_S INT64_C(1000000000)
#define NS_PER_MS INT64_C(1000000)
#define NS_PER_US INT64_C(1000)

/* Any thread. */
int64_t clock_now_ns(void);

/* CLOCK_MONOTONIC, also in virtual time: for the patience with programs outside. Any thread. */
int64_t clock_real_now_ns(void);

/* Sleeps until the clock reads at least `wake_ns`; returns at once when that has passed.
 * Real-time safe in real time. */
void clock_sleep_until(int64_t wake_ns);

/* Wakes one thread that waits for work or for a time. */
struct clock_semaphore {
	sem_t real;
	_Atomic bool posted; /* virtual time */
};

void clock_semaphore_init(struct clock_semaphore *semaphore);
void clock_semaphore_finish(struct clock_semaphore *semaphore);

/* Any thread; real-time safe in real time. */
void clock_semaphore_post(struct clock_semaphore *semaphore);

/* Until something was posted, at most until `deadline_ns`; one return serves all that was posted.
 * In virtual time it returns when all other threads have come to rest as well, so that it does not
 * matter in which order they posted. One waiting thread; real-time safe in real time. */
void clock_semaphore_wait(struct clock_semaphore *semaphore, int64_t deadline_ns);

/* Makes `fd` readable when the clock reads `wake_ns`, for an event loop. */
struct clock_alarm {
	int fd; /* owned */
	int64_t wake_ns;
	bool due; /* virtual time: it went off and was not set again */
	struct clock_alarm *next;
};

/* Set to nothing. Returns 0 or a negative errno. The alarm stays where it is until it is closed. */
int clock_alarm_open(struct clock_alarm *alarm);
void clock_alarm_close(struct clock_alarm *alarm); /* a zeroed alarm is fine */

/* Also says that the alarm before was dealt with: virtual time stands still until then. */
void clock_alarm_set(struct clock_alarm *alarm, int64_t wake_ns);
