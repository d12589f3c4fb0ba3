/*
 * Scheduling, locked memory, and the frame around every real-time thread.
 */
#include "daemon/realtime.h"

#include <errno.h>
#include <sched.h>
#include <string.h>
#include <sys/mman.h>

#include "base/clock_virtual.h"
#include "base/log.h"
#include "base/realtime.h"

#define STACK_BYTES (512u * 1024u)
#define STACK_USED_BYTES (384u * 1024u) /* touched at the start; the rest is for the C library */
#define JOIN_PATIENCE_NS (500 * NS_PER_MS)
#define JOIN_PATIENCE_VIRTUAL_NS (20 * NS_PER_S) /* of threads without priority */

/* All there is comes into memory now; what is mapped later, such as the 8 MB stacks of libraries'
 * threads, when it is touched. */
bool realtime_lock_memory(void)
{
	if (mlockall(MCL_CURRENT) == 0 && mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0)
		return true;
	log_warning("memory is not locked (%s): pages may be swapped out while live; set "
		    "LimitMEMLOCK=infinity in the unit",
		    strerror(errno));
	munlockall(); /* half a lock would make later allocations fail at the limit */
	return false;
}

static __attribute__((noinline)) void touch_stack(void)
{
	unsigned char stack[STACK_USED_BYTES];

	stack[0] = 0;
	realtime_touch(stack, sizeof(stack));
}

static void *run_section(void *argument)
{
	struct realtime_thread *thread = argument;

	touch_stack();
	clock_thread_begin();
	realtime_enter();
	thread->run(thread->argument);
	realtime_leave();
	heartbeat_end(&thread->heartbeat);
	clock_thread_end();
	return NULL;
}

static int start_thread(struct realtime_thread *thread, int policy, int priority)
{
	struct sched_param param = {.sched_priority = priority};
	pthread_attr_t attributes;

	pthread_attr_init(&attributes);
	pthread_attr_setstacksize(&attributes, STACK_BYTES);
	pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
	pthread_attr_setschedpolicy(&attributes, policy);
	pthread_attr_setschedparam(&attributes, &param);
	int err = -pthread_create(&thread->id, &attributes, run_section, thread);
	pthread_attr_destroy(&attributes);
	return err;
}

int realtime_thread_start(struct realtime_thread *thread, int priority)
{
	char short_name[16] = {0};

	if (thread->joinable)
		return -EBUSY; /* the one before it still hangs */
	thread->told_ns = 0;
	heartbeat_expect(&thread->heartbeat, clock_now_ns());
	clock_thread_expect();
	/* in virtual time nothing is in a hurry */
	int err = clock_is_virtual() ? -EPERM : start_thread(thread, SCHED_FIFO, priority);

	thread->fifo_granted = !err;
	if (err == -EPERM)
		err = start_thread(thread, SCHED_OTHER, 0);
	if (err) {
		clock_thread_withdraw();
		heartbeat_forget(&thread->heartbeat);
		return err;
	}
	thread->joinable = true;
	memcpy(short_name, thread->name, strnlen(thread->name, sizeof(short_name) - 1));
	pthread_setname_np(thread->id, short_name);
	return 0;
}

void realtime_thread_tell(struct realtime_thread *thread)
{
	if (!thread->told_ns)
		thread->told_ns = clock_real_now_ns();
}

bool realtime_thread_join(struct realtime_thread *thread)
{
	realtime_thread_tell(thread);
	int64_t until_ns = thread->told_ns +
			   (clock_is_virtual() ? JOIN_PATIENCE_VIRTUAL_NS : JOIN_PATIENCE_NS);
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	if (!thread->joinable)
		return true;
	if (pthread_clockjoin_np(thread->id, NULL, CLOCK_MONOTONIC, &until) != 0)
		return false;
	thread->joinable = false;
	heartbeat_forget(&thread->heartbeat);
	return true;
}
