/*
 * fork, exec and wait; logs are files, so that nobody has to read pipes while the stream runs.
 */
#include "demo/children.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"

#define PATIENCE_NS (5 * NS_PER_S)
#define LOG_LINES_SHOWN 8

/* Its own process group: Ctrl-C reaches the demonstration alone, which then ends its children. */
static void run_child(int log_fd, bool told, char *const argv[], pid_t parent)
{
	sigset_t none;

	sigemptyset(&none);
	sigprocmask(SIG_SETMASK, &none, NULL);
	setpgid(0, 0);
	prctl(PR_SET_PDEATHSIG, SIGTERM);
	if (getppid() != parent)
		_exit(127);
	dup2(log_fd, STDOUT_FILENO);
	if (!told)
		dup2(log_fd, STDERR_FILENO);
	int nothing_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
	dup2(nothing_fd, STDIN_FILENO);
	execv(argv[0], argv);
	dprintf(log_fd, "%s: %s\n", argv[0], strerror(errno));
	_exit(127);
}

static int start(struct child *child, const char *name, const char *log_dir, bool told,
		 char *const argv[], struct diag *diag)
{
	pid_t parent = getpid();

	child->name = name;
	snprintf(child->log_path, sizeof(child->log_path), "%s/%s.log", log_dir, name);
	int log_fd = open(child->log_path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
	pid_t pid = log_fd < 0 ? -1 : fork();
	if (pid == 0)
		run_child(log_fd, told, argv, parent);
	int error = errno;
	if (log_fd >= 0)
		close(log_fd);
	if (pid < 0) {
		diag_add(diag, "%s: cannot start %s: %s", name, argv[0], strerror(error));
		return -error;
	}
	child->pid = pid;
	return 0;
}

int child_start(struct child *child, const char *name, const char *log_dir, char *const argv[],
		struct diag *diag)
{
	return start(child, name, log_dir, false, argv, diag);
}

int child_start_told(struct child *child, const char *name, const char *log_dir, char *const argv[],
		     struct diag *diag)
{
	return start(child, name, log_dir, true, argv, diag);
}

bool child_is_running(struct child *child)
{
	if (child->pid > 0 && waitpid(child->pid, NULL, WNOHANG) != 0)
		child->pid = 0;
	return child->pid > 0;
}

void child_stop(struct child *child)
{
	int64_t deadline_ns = clock_now_ns() + PATIENCE_NS;

	if (!child_is_running(child))
		return;
	kill(child->pid, SIGTERM);
	while (child_is_running(child)) {
		if (clock_now_ns() > deadline_ns)
			kill(child->pid, SIGKILL);
		clock_sleep_until(clock_now_ns() + 10 * NS_PER_MS);
	}
}

void child_explain(const struct child *child, struct diag *diag)
{
	char lines[LOG_LINES_SHOWN][512];
	unsigned count = 0;
	FILE *log = fopen(child->log_path, "r");

	diag_add(diag, "%s has ended; its last words:", child->name);
	if (!log)
		return;
	while (fgets(lines[count % LOG_LINES_SHOWN], sizeof(lines[0]), log))
		count++;
	fclose(log);
	for (unsigned i = count > LOG_LINES_SHOWN ? count - LOG_LINES_SHOWN : 0; i < count; i++) {
		char *line = lines[i % LOG_LINES_SHOWN];

		line[strcspn(line, "\n")] = '\0';
		diag_add(diag, "    %s", line);
	}
}

bool child_find_line(const struct child *child, const char *word, char *line, size_t size)
{
	bool found = false;
	FILE *log = fopen(child->log_path, "r");

	if (!log)
		return false;
	while (!found && fgets(line, (int)size, log))
		found = strncmp(line, word, strlen(word)) == 0;
	fclose(log);
	return found;
}
