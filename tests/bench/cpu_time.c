/*
 * /proc/PID/stat counts in ticks of 10 ms; schedstat of each thread counts in nanoseconds.
 */
#include "tests/bench/cpu_time.h"

#include <dirent.h>
#include <inttypes.h>
#include <stdio.h>

static int64_t thread_cpu_ns(pid_t pid, const char *thread)
{
	char path[320];
	int64_t cpu_ns = 0;

	snprintf(path, sizeof(path), "/proc/%d/task/%s/schedstat", (int)pid, thread);
	FILE *file = fopen(path, "r");
	if (!file)
		return 0;
	if (fscanf(file, "%" SCNd64, &cpu_ns) != 1)
		cpu_ns = 0;
	fclose(file);
	return cpu_ns;
}

int64_t process_cpu_ns(pid_t pid)
{
	char path[64];
	int64_t sum_ns = 0;
	struct dirent *entry;

	snprintf(path, sizeof(path), "/proc/%d/task", (int)pid);
	DIR *dir = opendir(path);
	while (dir && (entry = readdir(dir)))
		if (entry->d_name[0] != '.')
			sum_ns += thread_cpu_ns(pid, entry->d_name);
	if (dir)
		closedir(dir);
	return sum_ns;
}

int64_t side_threads_cpu_ns(pid_t pid)
{
	char main_thread[16];

	snprintf(main_thread, sizeof(main_thread), "%d", (int)pid);
	return process_cpu_ns(pid) - thread_cpu_ns(pid, main_thread);
}
