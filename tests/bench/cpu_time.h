/*
 * CPU time of another process, to the nanosecond: all its threads, from /proc.
 */
#pragma once

#include <stdint.h>
#include <sys/types.h>

/* Threads that ended are not counted. 0 when the process is gone. */
int64_t process_cpu_ns(pid_t pid);

/* The same without its main thread. */
int64_t side_threads_cpu_ns(pid_t pid);
