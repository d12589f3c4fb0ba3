/*
 * What clock.c asks of virtual time. Nobody else includes this.
 */
#pragma once

#include "base/clock.h"

int64_t conductor_now_ns(void);

/* Until `wake_ns`, or, with a semaphore, until all others rest and it was posted. */
void conductor_wait(struct clock_semaphore *semaphore, int64_t wake_ns);
void conductor_post(struct clock_semaphore *semaphore);

int conductor_alarm_open(struct clock_alarm *alarm);
void conductor_alarm_remove(struct clock_alarm *alarm);
void conductor_alarm_set(struct clock_alarm *alarm, int64_t wake_ns);
