/*
 * Spawns the guard and talks to it through a timer, a socket and a page of memory: none of them
 * blocks the trigger thread.
 */
#include "drivers/gpio/trigger_guard.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"

#define READY_PATIENCE_MS 2000
#define END_PATIENCE_NS (100 * NS_PER_MS)
#define PROGRAM_ENV "STAGE_GUARD" /* for programs that do not lie beside it */

/* Beside the program that runs. */
static int find_program(char path[PATH_MAX])
{
	const char *given = getenv(PROGRAM_ENV);
	ssize_t length;

	if (given) {
		snprintf(path, PATH_MAX, "%s", given);
		return access(path, X_OK) < 0 ? -errno : 0;
	}
	length = readlink("/proc/self/exe", path, PATH_MAX - 1);
	if (length < 0)
		return -errno;
	path[length] = 0;
	char *name = strrchr(path, '/') + 1;
	snprintf(name, (size_t)(path + PATH_MAX - name), "stage-guard");
	return access(path, X_OK) < 0 ? -errno : 0;
}

/* With descriptors out of the way of the guard's numbers. */
static int move_up(int fd)
{
	int moved = fcntl(fd, F_DUPFD_CLOEXEC, GUARD_FD_END);

	close(fd);
	return moved;
}

static int make_page(struct trigger_guard *guard, int *fd)
{
	*fd = move_up(memfd_create("stage-guard", MFD_CLOEXEC));
	if (*fd < 0 || ftruncate(*fd, sizeof(*guard->page)) < 0)
		return -errno;
	void *page = mmap(NULL, sizeof(*guard->page), PROT_READ | PROT_WRITE, MAP_SHARED, *fd, 0);
	if (page == MAP_FAILED)
		return -errno;
	guard->page = page;
	return 0;
}

static int spawn(struct trigger_guard *guard, const int fds[GUARD_FD_END], uint32_t count,
		 uint32_t dark_levels)
{
	char path[PATH_MAX], count_text[16], levels_text[16];
	char *arguments[] = {path, count_text, levels_text, NULL}, *environment[] = {NULL};
	posix_spawn_file_actions_t actions;
	posix_spawnattr_t attributes;
	sigset_t none;
	int err = find_program(path);

	if (err)
		return err;
	snprintf(count_text, sizeof(count_text), "%u", count);
	snprintf(levels_text, sizeof(levels_text), "%u", dark_levels);
	sigemptyset(&none);
	posix_spawn_file_actions_init(&actions);
	posix_spawnattr_init(&attributes);
	for (int i = GUARD_LINES; i < GUARD_FD_END; i++)
		posix_spawn_file_actions_adddup2(&actions, fds[i], i);
	/* a session of its own: what a terminal sends does not reach it */
	posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
	posix_spawnattr_setsigmask(&attributes, &none);
	err = -posix_spawn(&guard->pid, path, &actions, &attributes, arguments, environment);
	posix_spawn_file_actions_destroy(&actions);
	posix_spawnattr_destroy(&attributes);
	if (err)
		guard->pid = 0;
	return err;
}

/* It says one byte when its memory is locked. */
static int await_ready(const struct trigger_guard *guard)
{
	struct pollfd polled = {.fd = guard->station_fd, .events = POLLIN};
	char byte;

	if (poll(&polled, 1, READY_PATIENCE_MS) <= 0)
		return -ETIMEDOUT;
	return recv(guard->station_fd, &byte, 1, MSG_DONTWAIT) == 1 ? 0 : -ECHILD;
}

int trigger_guard_start(struct trigger_guard *guard, int lines_fd, uint32_t count,
			uint32_t dark_levels, const char *who, struct diag *diag)
{
	int fds[GUARD_FD_END], ends[2] = {-1, -1}, err;

	memset(guard, 0, sizeof(*guard));
	for (int i = 0; i < GUARD_FD_END; i++)
		fds[i] = -1;
	guard->timer_fd = guard->station_fd = -1;
	fds[GUARD_LINES] = fcntl(lines_fd, F_DUPFD_CLOEXEC, GUARD_FD_END);
	fds[GUARD_TIMER] = move_up(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
	if (fds[GUARD_LINES] < 0 || fds[GUARD_TIMER] < 0 ||
	    socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) < 0) {
		err = -errno;
		goto done;
	}
	guard->timer_fd = fcntl(fds[GUARD_TIMER], F_DUPFD_CLOEXEC, 0);
	guard->station_fd = ends[0];
	fds[GUARD_STATION] = move_up(ends[1]);
	err = make_page(guard, &fds[GUARD_PAGE]);
	if (!err)
		err = spawn(guard, fds, count, dark_levels);
done:
	for (int i = GUARD_LINES; i < GUARD_FD_END; i++)
		if (fds[i] >= 0)
			close(fds[i]);
	if (!err)
		err = await_ready(
			guard); /* our copy of its end is closed: it hangs up if it dies */
	if (err) {
		diag_add(diag,
			 "%s: no guard for the lines: cannot start stage-guard: %s; it belongs "
			 "beside the program, or where " PROGRAM_ENV " says",
			 who, strerror(-err));
		trigger_guard_stop(guard);
	}
	return err ? -ECHILD : 0;
}

static void reap(pid_t pid)
{
	int64_t until_ns = clock_real_now_ns() + END_PATIENCE_NS;

	while (waitpid(pid, NULL, WNOHANG) == 0) {
		if (clock_real_now_ns() > until_ns)
			kill(pid, SIGKILL);
		usleep(500);
	}
}

void trigger_guard_stop(struct trigger_guard *guard)
{
	if (guard->station_fd > 0)
		close(guard->station_fd);
	if (guard->pid > 0)
		reap(guard->pid);
	if (guard->timer_fd > 0)
		close(guard->timer_fd);
	if (guard->page)
		munmap(guard->page, sizeof(*guard->page));
	memset(guard, 0, sizeof(*guard));
}

static void set_timer(const struct trigger_guard *guard, int64_t when_ns)
{
	struct itimerspec timer = {.it_value = {when_ns / NS_PER_S, when_ns % NS_PER_S}};

	timerfd_settime(guard->timer_fd, TFD_TIMER_ABSTIME, &timer, NULL);
}

void trigger_guard_watch(struct trigger_guard *guard, int64_t until_ns)
{
	set_timer(guard, until_ns);
}

void trigger_guard_rest(struct trigger_guard *guard)
{
	set_timer(guard, 0);
}

bool trigger_guard_lives(const struct trigger_guard *guard)
{
	struct pollfd polled = {.fd = guard->station_fd};

	return guard->pid > 0 && poll(&polled, 1, 0) == 0;
}

bool trigger_guard_has_cut(struct trigger_guard *guard)
{
	uint32_t cuts = guard->page ? atomic_load(&guard->page->cut_count) : 0;
	bool cut = cuts != guard->cuts_seen;

	guard->cuts_seen = cuts;
	return cut;
}
