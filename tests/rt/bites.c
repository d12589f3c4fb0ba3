/*
 * The guard itself: what is forbidden aborts inside a section, and is left alone everywhere else.
 * Runs with the guard preloaded.
 */
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <syslog.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/realtime.h"

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static void *volatile memory; /* volatile: the compiler may not drop the pair */
static int event_fd;

static void do_malloc(void)
{
	memory = malloc(100);
}

static void do_calloc(void)
{
	memory = calloc(10, 10);
}

static void do_realloc(void)
{
	memory = realloc(memory, 1000);
}

static void do_free(void)
{
	free(memory);
	memory = NULL;
}

static void do_posix_memalign(void)
{
	void *aligned;

	if (posix_memalign(&aligned, 64, 64) == 0)
		memory = aligned;
}

static void do_aligned_alloc(void)
{
	memory = aligned_alloc(64, 64);
}

static void do_strdup(void)
{
	memory = strdup("a text");
}

static void do_mmap(void)
{
	mmap(NULL, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
}

static void do_mutex(void)
{
	pthread_mutex_lock(&mutex);
	pthread_mutex_unlock(&mutex);
}

static void do_printf(void)
{
	fprintf(stderr, "a %d\n", 1);
}

static void do_log(void)
{
	log_info("a line");
}

static void do_syslog(void)
{
	syslog(LOG_DEBUG, "a line");
}

static void do_write(void)
{
	if (write(STDERR_FILENO, "\n", 1) < 0)
		return;
}

static void do_open(void)
{
	close(open("/dev/null", O_RDONLY));
}

static void do_fopen(void)
{
	fclose(fopen("/dev/null", "r"));
}

static void do_nanosleep(void)
{
	nanosleep(&(struct timespec){0, 1000}, NULL);
}

static const struct {
	const char *call; /* as the guard names it */
	void (*run)(void);
} forbidden[] = {
	{"malloc", do_malloc},
	{"calloc", do_calloc},
	{"realloc", do_realloc},
	{"free", do_free},
	{"posix_memalign", do_posix_memalign},
	{"aligned_alloc", do_aligned_alloc},
	{"malloc", do_strdup},
	{"mmap", do_mmap},
	{"pthread_mutex_lock", do_mutex},
	{"fprintf", do_printf},
	{"write", do_log},
	{"syslog", do_syslog},
	{"write", do_write},
	{"open", do_open},
	{"fopen", do_fopen},
	{"nanosleep", do_nanosleep},
};

#define FORBIDDEN_COUNT (sizeof(forbidden) / sizeof(forbidden[0]))

static void allowed(void)
{
	struct clock_semaphore semaphore;
	bool was_in_section = realtime_pause();

	clock_semaphore_init(&semaphore); /* not part of the section */
	realtime_resume(was_in_section);
	clock_semaphore_post(&semaphore);
	clock_semaphore_wait(&semaphore, clock_now_ns() + NS_PER_MS);
	clock_sleep_until(clock_now_ns() + NS_PER_MS);
	eventfd_write(event_fd, 1);
}

/* Runs it in a child of its own; returns the wait status and what it said. */
static int run_child(void (*run)(void), bool in_section, char *said, size_t size)
{
	struct rlimit no_core = {0};
	int ends[2], status;

	assert_int_equal(pipe(ends), 0);
	pid_t child = fork();
	if (child == 0) {
		setrlimit(RLIMIT_CORE, &no_core);
		signal(SIGABRT, SIG_DFL); /* cmocka's would go on with the next test */
		dup2(ends[1], STDERR_FILENO);
		if (in_section)
			realtime_enter();
		run();
		realtime_leave();
		_exit(0);
	}
	close(ends[1]);
	ssize_t got, used = 0;
	while ((got = read(ends[0], said + used, size - 1 - (size_t)used)) > 0)
		used += got;
	said[used] = '\0';
	close(ends[0]);
	waitpid(child, &status, 0);
	return status;
}

static void what_is_forbidden_aborts_in_a_section_and_is_named(void **state)
{
	char said[16384], wanted[80];

	(void)state;
	for (size_t i = 0; i < FORBIDDEN_COUNT; i++) {
		int status = run_child(forbidden[i].run, true, said, sizeof(said));

		snprintf(wanted, sizeof(wanted), "rt guard: %s called in a real-time section",
			 forbidden[i].call);
		if (!WIFSIGNALED(status) || WTERMSIG(status) != SIGABRT || !strstr(said, wanted))
			fail_msg("%s: status %x, said: %s", forbidden[i].call, status, said);
		assert_non_null(strstr(said, "bites")); /* the backtrace */
	}
}

static void outside_a_section_all_is_allowed(void **state)
{
	char said[16384];

	(void)state;
	for (size_t i = 0; i < FORBIDDEN_COUNT; i++)
		assert_int_equal(run_child(forbidden[i].run, false, said, sizeof(said)), 0);
}

static void pause_malloc(void)
{
	bool was_in_section = realtime_pause();

	memory = malloc(100);
	realtime_resume(was_in_section);
}

static void pause_and_resume(void)
{
	pause_malloc();
	memory = malloc(100);
}

static void a_paused_section_is_none_until_it_is_resumed(void **state)
{
	char said[16384];

	(void)state;
	assert_int_equal(run_child(pause_malloc, true, said, sizeof(said)), 0);
	assert_true(WIFSIGNALED(run_child(pause_and_resume, true, said, sizeof(said))));
	assert_int_equal(run_child(pause_and_resume, false, said, sizeof(said)), 0);
}

static void waiting_and_waking_are_allowed_in_a_section(void **state)
{
	char said[16384];

	(void)state;
	assert_int_equal(run_child(allowed, true, said, sizeof(said)), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_forbidden_aborts_in_a_section_and_is_named),
		cmocka_unit_test(outside_a_section_all_is_allowed),
		cmocka_unit_test(a_paused_section_is_none_until_it_is_resumed),
		cmocka_unit_test(waiting_and_waking_are_allowed_in_a_section),
	};

	event_fd = eventfd(0, EFD_NONBLOCK);
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
