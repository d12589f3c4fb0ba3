/*
 * Rings hold every buffer of a stream, so they are never full.
 */
#include "drivers/libcamera/libcamera_flow.h"

#include <errno.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"

#define THREAD_PRIORITY 55 /* above the capture threads, below the trigger */
#define QUEUE_PRIORITY (THREAD_PRIORITY + 1)
#define LOOK_NS (400 * NS_PER_MS)

/* Of a device that is gone libcamera's one thread waits on, and is woken without an end: as long as
 * the process lives it may take no more of a processor than any other. */
static atomic_bool runs_away;

int libcamera_flow_init(struct libcamera_flow *flow, const struct libcamera_at *at)
{
	flow->at = at;
	sem_init(&flow->ready, 0, 0);
	sem_init(&flow->given, 0, 0);
	if (ring_init(&flow->arrived, sizeof(struct libcamera_finished), LIBCAMERA_BUFFERS_MAX) ==
		    0 &&
	    ring_init(&flow->released, sizeof(uint32_t), LIBCAMERA_BUFFERS_MAX) == 0)
		return 0;
	libcamera_flow_finish(flow);
	return -ENOMEM;
}

void libcamera_flow_finish(struct libcamera_flow *flow)
{
	ring_finish(&flow->arrived);
	ring_finish(&flow->released);
	sem_destroy(&flow->ready);
	sem_destroy(&flow->given);
}

static void become_realtime(int priority)
{
	struct sched_param param = {.sched_priority = priority};

	/* Where it is not allowed it works, with more jitter: doctor's business. */
	pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
}

/* libcamera's thread. */
static void on_done(void *user, const struct libcamera_done *done)
{
	struct libcamera_flow *flow = user;
	int64_t now_ns = clock_now_ns();

	if (!flow->realtime && !runs_away) {
		flow->completing_thread = pthread_self();
		become_realtime(THREAD_PRIORITY);
		flow->realtime = true;
	}
	if (flow->ending)
		return;
	struct libcamera_finished *finished = ring_claim(&flow->arrived);

	if (!finished)
		return;
	*finished = (struct libcamera_finished){*done, now_ns};
	ring_publish(&flow->arrived);
	sem_post(&flow->ready);
}

/* libcamera's thread, or the driver's. */
static void on_gone(void *user)
{
	struct libcamera_flow *flow = user;
	struct sched_param param = {0};

	runs_away = true;
	if (flow->realtime)
		pthread_setschedparam(flow->completing_thread, SCHED_OTHER, &param);
	flow->gone = true;
	sem_post(&flow->ready);
}

/* libcamera tells the leave of cameras on USB only: sensors are looked for. */
static void look_for_sensor(struct libcamera_flow *flow)
{
	if (!flow->gone && *flow->at->sensor && access(flow->at->sensor, F_OK))
		on_gone(flow);
}

/* Also after a while in which nothing was given. */
static void wait_given(struct libcamera_flow *flow)
{
	int64_t until_ns = clock_now_ns() + LOOK_NS;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	while (sem_clockwait(&flow->given, CLOCK_MONOTONIC, &until))
		if (errno == ETIMEDOUT) {
			look_for_sensor(flow);
			return;
		}
}

/* The driver's thread; what libcamera's does cannot keep it from looking for the sensor. */
static void *queue_released(void *user)
{
	struct libcamera_flow *flow = user;

	pthread_setname_np(pthread_self(), "libcamera-queue");
	become_realtime(QUEUE_PRIORITY);
	while (!flow->ending) {
		uint32_t *buffer = ring_peek(&flow->released, 0);

		if (!buffer || flow->gone) {
			wait_given(flow);
			continue;
		}
		libcamera_shim_queue(flow->at->device, *buffer);
		ring_pop(&flow->released);
	}
	return NULL;
}

static void forget_all(struct libcamera_flow *flow)
{
	ring_clear(&flow->arrived);
	ring_clear(&flow->released);
	while (sem_trywait(&flow->ready) == 0 || sem_trywait(&flow->given) == 0)
		;
	flow->ending = false;
}

int libcamera_flow_start(struct libcamera_flow *flow, const struct libcamera_light *light)
{
	struct libcamera_hooks hooks = {on_done, on_gone, flow};
	int error;

	if (flow->gone)
		return -ENODEV;
	forget_all(flow);
	error = -pthread_create(&flow->queue_thread, NULL, queue_released, flow);
	if (error)
		return error;
	flow->streams = true;
	error = libcamera_shim_start(flow->at->device, light, &hooks);
	if (error)
		libcamera_flow_stop(flow);
	return error;
}

/* A camera that is gone is not stopped: see libcamera_shim_abandon(). */
void libcamera_flow_stop(struct libcamera_flow *flow)
{
	if (!flow->streams)
		return;
	flow->ending = true;
	sem_post(&flow->given);
	pthread_join(flow->queue_thread, NULL);
	look_for_sensor(flow);
	if (!flow->gone)
		libcamera_shim_stop(flow->at->device);
	flow->streams = false;
}

int libcamera_flow_wait(struct libcamera_flow *flow, int64_t timeout_ns,
			struct libcamera_finished *out)
{
	int64_t until_ns = clock_now_ns() + timeout_ns;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};
	struct libcamera_finished *item;
	int error = 0;

	while (!flow->gone && sem_clockwait(&flow->ready, CLOCK_MONOTONIC, &until) && !error)
		error = errno == EINTR ? 0 : -errno;
	if (flow->gone)
		return -ENODEV;
	item = ring_peek(&flow->arrived, 0);
	if (!item)
		return error ? error : -ETIMEDOUT;
	*out = *item;
	ring_pop(&flow->arrived);
	return 0;
}

void libcamera_flow_give(struct libcamera_flow *flow, uint32_t buffer)
{
	uint32_t *item = ring_claim(&flow->released);

	if (!item)
		return;
	*item = buffer;
	ring_publish(&flow->released);
	sem_post(&flow->given);
}
