/*
 * Preloaded into staged: a thread whose name begins with HANG_THREAD sleeps forever at its next
 * sleep, once the file HANG_FILE is there. What a driver does that never comes back.
 */
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

static int (*real_sleep)(clockid_t clock, int flags, const struct timespec *wake,
			 struct timespec *left);

static __attribute__((constructor)) void begin(void)
{
	*(void **)&real_sleep = dlsym(RTLD_NEXT, "clock_nanosleep");
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *wake, struct timespec *left)
{
	const char *thread = getenv("HANG_THREAD"), *file = getenv("HANG_FILE");
	char name[16] = "";

	prctl(PR_GET_NAME, name);
	while (thread && file && strncmp(name, thread, strlen(thread)) == 0 &&
	       access(file, F_OK) == 0)
		pause();
	return real_sleep(clock, flags, wake, left);
}
