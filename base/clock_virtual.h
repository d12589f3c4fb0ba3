/*
 * Virtual time: it stands still while any of its threads is at work and then jumps to the earliest
 * time that one of them waits for. A slow machine makes a test slow, and changes nothing else.
 *
 * Who counts: threads between clock_thread_begin() and clock_thread_end(), and whoever holds time
 * with clock_hold(). In real time all calls but clock_virtual_begin() do nothing.
 */
#pragma once

#include "base/clock.h"

#define CLOCK_NO_LIMIT INT64_MAX

/* From now on clock_now_ns() reads `start_ns` (> 0), and goes no further than `limit_ns` until
 * clock_virtual_set_limit(). Before any other thread of this clock is there. */
void clock_virtual_begin(int64_t start_ns, int64_t limit_ns);

/* Back to real time, when all threads and alarms of this clock are gone. */
void clock_virtual_end(void);

bool clock_is_virtual(void);

/* The thread that starts another one calls expect (or withdraw, when it could not be started); the
 * new thread calls begin first and end last. */
void clock_thread_expect(void);
void clock_thread_withdraw(void);
void clock_thread_begin(void);
void clock_thread_end(void);

/* Time stands still from hold to release: something is queued that is to be dealt with at this
 * moment. Any thread; every hold has its release. */
void clock_hold(void);
void clock_release(void);

/* While the caller waits for threads to end, time runs for them whatever holds it. */
void clock_rush_begin(void);
void clock_rush_end(void);

/* For time that is driven from outside. */
void clock_virtual_set_limit(int64_t limit_ns);
int64_t clock_virtual_limit(void);
bool clock_virtual_at_limit(void); /* nothing more happens before the limit is raised */
