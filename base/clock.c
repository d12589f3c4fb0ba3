/*
 * CLOCK_MONOTONIC as one number, absolute waits that survive signals; in virtual time the conductor
 * is asked instead.
 */
#include "base/clock.h"

#include <errno.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "base/clock_conductor.h"
#include "base/clock_virtual.h"

static struct timespec timespec_of(int64_t time_ns)
{
	return (struct timespec){.tv_sec = time_ns / NS_PER_S, .tv_nsec = time_ns % NS_PER_S};
}

int64_t clock_real_now_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return now.tv_sec * NS_PER_S + now.tv_nsec;
}

int64_t clock_now_ns(void)
{
	return clock_is_virtual() ? conductor_now_ns() : clock_real_now_ns();
}

void clock_sleep_until(int64_t wake_ns)
{
	struct timespec wake = timespec_of(wake_ns);

	if (wake_ns <= 0)
		return;
	if (clock_is_virtual()) {
		conductor_wait(NULL, wake_ns);
		return;
	}
	while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, NULL) == EINTR)
		;
}

void clock_semaphore_init(struct clock_semaphore *semaphore)
{
	memset(semaphore, 0, sizeof(*semaphore));
	sem_init(&semaphore->real, 0, 0);
}

void clock_semaphore_finish(struct clock_semaphore *semaphore)
{
	sem_destroy(&semaphore->real);
}

void clock_semaphore_post(struct clock_semaphore *semaphore)
{
	if (clock_is_virtual())
		conductor_post(semaphore);
	else
		sem_post(&semaphore->real);
}

void clock_semaphore_wait(struct clock_semaphore *semaphore, int64_t deadline_ns)
{
	struct timespec deadline = timespec_of(deadline_ns);

	if (clock_is_virtual()) {
		conductor_wait(semaphore, deadline_ns);
		return;
	}
	sem_clockwait(&semaphore->real, CLOCK_MONOTONIC, &deadline);
	while (sem_trywait(&semaphore->real) == 0)
		; /* one look serves all that was posted */
}

int clock_alarm_open(struct clock_alarm *alarm)
{
	if (clock_is_virtual())
		return conductor_alarm_open(alarm);
	int fd = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
	if (fd < 0)
		return -errno;
	*alarm = (struct clock_alarm){.fd = fd};
	return 0;
}

void clock_alarm_close(struct clock_alarm *alarm)
{
	if (alarm->fd <= 0)
		return;
	if (clock_is_virtual())
		conductor_alarm_remove(alarm);
	close(alarm->fd);
	memset(alarm, 0, sizeof(*alarm));
}

void clock_alarm_set(struct clock_alarm *alarm, int64_t wake_ns)
{
	struct itimerspec at = {.it_value = timespec_of(wake_ns)};
	uint64_t times;

	eventfd_read(alarm->fd, &times); /* fails when it had not gone off; a timerfd reads alike */
	if (clock_is_virtual())
		conductor_alarm_set(alarm, wake_ns);
	else
		timerfd_settime(alarm->fd, TFD_TIMER_ABSTIME, &at, NULL);
}
