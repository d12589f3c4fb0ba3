/*
 * Time: CLOCK_MONOTONIC in nanoseconds, the only clock of the station.
 */
#pragma once

#include <stdint.h>

#define NS_PER_S INT64_C(1000000000)
#define NS_PER_MS INT64_C(1000000)
#define NS_PER_US INT64_C(1000)

/* Any thread. */
int64_t clock_now_ns(void);

/* Sleeps until the clock reads at least `wake_ns`; returns at once when that has passed.
 * Real-time safe. */
void clock_sleep_until(int64_t wake_ns);
