/*
 * The floor under a station's latency: the same bytes plainly read on as many threads, one wake-up,
 * one send. floor SOCKET_FD: writes messages of the stream's size that begin with the due time.
 */
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/clock.h"
#include "tests/bench/floor.h"
#include "tests/bench/frame_pool.h"

#define PRIORITY_READ 40
#define PRIORITY_SEND 20
#define FRAMES_KEPT 64

struct reader {
	struct frame_pool pool;
	pthread_t thread;
};

static struct reader readers[POOL_CAMERAS];
static sem_t frame_done;
static _Atomic int done_count[FRAMES_KEPT];
static _Atomic uint64_t sum; /* so that reading is not optimised away */

static bool be_realtime(int priority)
{
	struct sched_param param = {.sched_priority = priority};

	return pthread_setschedparam(pthread_self(), SCHED_FIFO, &param) == 0;
}

static void *read_frames(void *argument)
{
	struct reader *reader = argument;
	int64_t due_ns;
	uint64_t frame = frame_pool_next(clock_now_ns() + NS_PER_S / 10, &due_ns);

	be_realtime(PRIORITY_READ);
	for (;; frame++, due_ns += POOL_PERIOD_NS) {
		clock_sleep_until(due_ns);
		atomic_fetch_add(&sum, frame_pool_sum(&reader->pool, frame));
		if (atomic_fetch_add(&done_count[frame % FRAMES_KEPT], 1) == POOL_CAMERAS - 1) {
			atomic_store(&done_count[frame % FRAMES_KEPT], 0);
			sem_post(&frame_done);
		}
	}
	return NULL;
}

static int send_messages(int fd)
{
	static unsigned char message[FLOOR_MESSAGE_BYTES];

	for (;;) {
		sem_wait(&frame_done);
		int64_t due_ns = clock_now_ns() / POOL_PERIOD_NS * POOL_PERIOD_NS;
		memcpy(message, &due_ns, sizeof(due_ns));
		if (write(fd, message, sizeof(message)) != (ssize_t)sizeof(message))
			return errno == EPIPE ? 0 : 1;
	}
}

int main(int argc, char **argv)
{
	if (argc != 2)
		return 2;
	mlockall(MCL_CURRENT | MCL_FUTURE);
	sem_init(&frame_done, 0, 0);
	for (uint32_t c = 0; c < POOL_CAMERAS; c++)
		if (frame_pool_init(&readers[c].pool, 1, c))
			return 1;
	for (uint32_t c = 0; c < POOL_CAMERAS; c++)
		if (pthread_create(&readers[c].thread, NULL, read_frames, &readers[c]))
			return 1;
	be_realtime(PRIORITY_SEND);
	return send_messages(atoi(argv[1]));
}
