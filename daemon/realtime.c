/*
 * Scheduling and locked memory.
 */
#include "daemon/realtime.h"

#include <errno.h>
#include <sched.h>
#include <string.h>
#include <sys/mman.h>

#include "base/clock_virtual.h"
#include "base/log.h"

#define STACK_BYTES (512u * 1024u)

bool realtime_lock_memory(void)
{
	if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0)
		return true;
	log_warning("memory is not locked (%s): pages may be swapped out while live; set "
		    "LimitMEMLOCK=infinity in the unit",
		    strerror(errno));
	return false;
}

static int start_thread(pthread_t *out, int policy, int priority, void *(*run)(void *),
			void *argument)
{
	struct sched_param param = {.sched_priority = priority};
	pthread_attr_t attributes;

	pthread_attr_init(&attributes);
	pthread_attr_setstacksize(&attributes, STACK_BYTES);
	pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
	pthread_attr_setschedpolicy(&attributes, policy);
	pthread_attr_setschedparam(&attributes, &param);
	int err = -pthread_create(out, &attributes, run, argument);
	pthread_attr_destroy(&attributes);
	return err;
}

int realtime_thread_start(pthread_t *out, const char *name, int priority, void *(*run)(void *),
			  void *argument, bool *granted)
{
	char short_name[16] = {0};
	bool fifo = !clock_is_virtual(); /* there, nothing is in a hurry */
	int err = -EPERM;

	clock_thread_expect();
	if (fifo)
		err = start_thread(out, SCHED_FIFO, priority, run, argument);
	if (err == -EPERM) {
		fifo = false;
		err = start_thread(out, SCHED_OTHER, 0, run, argument);
	}
	if (err) {
		clock_thread_withdraw();
		return err;
	}
	memcpy(short_name, name, strnlen(name, sizeof(short_name) - 1));
	pthread_setname_np(*out, short_name);
	*granted = fifo;
	return 0;
}
