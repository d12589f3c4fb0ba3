/*
 * Preloaded into a program, aborts it where a real-time section (base/realtime.h) allocates, locks,
 * prints or blocks, and says where. What is allowed: semaphores, eventfds, absolute sleeps, and the
 * waiting for a driver's own device (poll, ioctl). At the end it tells how many allowed calls came
 * from sections, so that a run in which no section was ever entered does not pass for a clean one.
 */
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <syslog.h>
#include <time.h>
#include <unistd.h>

#define FRAMES_MAX 40

static bool (*in_section)(void); /* the program's; NULL in one without sections */
static _Atomic unsigned long allowed_count;
static _Thread_local bool telling;

static void say(const char *text, size_t length)
{
	if (syscall(SYS_write, STDERR_FILENO, text, length) < 0)
		return; /* the abort says enough */
}

static void refuse(const char *call)
{
	void *frames[FRAMES_MAX];
	char text[160], thread[16] = "";

	telling = true;
	prctl(PR_GET_NAME, thread);
	int length =
		snprintf(text, sizeof(text),
			 "rt guard: %s called in a real-time section of thread %s\n", call, thread);
	say(text, (size_t)length);
	backtrace_symbols_fd(frames, backtrace(frames, FRAMES_MAX), STDERR_FILENO);
	abort();
}

static void check(const char *call)
{
	if (in_section && !telling && in_section())
		refuse(call);
}

static void count_allowed(void)
{
	if (in_section && in_section())
		atomic_fetch_add(&allowed_count, 1);
}

static void *find(const char *call)
{
	return dlsym(RTLD_NEXT, call);
}

static __attribute__((constructor)) void begin(void)
{
	void *frames[1];

	backtrace(frames, 1); /* loads its library now: that allocates */
	in_section = (bool (*)(void))(uintptr_t)dlsym(RTLD_DEFAULT, "realtime_in_section");
}

static __attribute__((destructor)) void report(void)
{
	static const char none[] = "rt guard: no real-time section was entered\n";
	const char *path = getenv("RT_GUARD_REPORT");

	if (in_section && getenv("RT_GUARD_WANTS_SECTIONS") && atomic_load(&allowed_count) == 0) {
		fflush(stdout);
		say(none, sizeof(none) - 1);
		_exit(1);
	}
	FILE *out = in_section && path ? fopen(path, "a") : NULL;

	if (!out)
		return;
	fprintf(out, "%s %lu\n", program_invocation_short_name, atomic_load(&allowed_count));
	fclose(out);
}

/* The C library's own, because looking them up allocates. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *memory);

void *malloc(size_t size)
{
	check("malloc");
	return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
	check("calloc");
	return __libc_calloc(count, size);
}

void *realloc(void *memory, size_t size)
{
	check("realloc");
	return __libc_realloc(memory, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
	check("aligned_alloc");
	return __libc_memalign(alignment, size);
}

void *memalign(size_t alignment, size_t size);
void *memalign(size_t alignment, size_t size)
{
	check("memalign");
	return __libc_memalign(alignment, size);
}

int posix_memalign(void **out, size_t alignment, size_t size)
{
	check("posix_memalign");
	void *memory = __libc_memalign(alignment, size);

	if (!memory)
		return ENOMEM;
	*out = memory;
	return 0;
}

void free(void *memory)
{
	check("free");
	__libc_free(memory);
}

/* Everything else is the next library's, after the check. */
#define FORBID(type, name, parameters, arguments)               \
	type name parameters                                    \
	{                                                       \
		static type(*real) parameters;                  \
                                                                \
		if (!real)                                      \
			real = (type(*) parameters)find(#name); \
		check(#name);                                   \
		return real arguments;                          \
	}

#define ALLOW(type, name, parameters, arguments)                \
	type name parameters                                    \
	{                                                       \
		static type(*real) parameters;                  \
                                                                \
		if (!real)                                      \
			real = (type(*) parameters)find(#name); \
		count_allowed();                                \
		return real arguments;                          \
	}

ALLOW(int, eventfd_write, (int fd, eventfd_t value), (fd, value))
ALLOW(int, sem_post, (sem_t * semaphore), (semaphore))
ALLOW(int, clock_nanosleep,
      (clockid_t clock, int flags, const struct timespec *wake, struct timespec *left),
      (clock, flags, wake, left))

FORBID(int, pthread_mutex_lock, (pthread_mutex_t * mutex), (mutex))
FORBID(int, pthread_mutex_timedlock, (pthread_mutex_t * mutex, const struct timespec *until),
       (mutex, until))
FORBID(int, pthread_rwlock_rdlock, (pthread_rwlock_t * lock), (lock))
FORBID(int, pthread_rwlock_wrlock, (pthread_rwlock_t * lock), (lock))
FORBID(int, pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t *mutex),
       (condition, mutex))
FORBID(int, pthread_cond_timedwait,
       (pthread_cond_t * condition, pthread_mutex_t *mutex, const struct timespec *until),
       (condition, mutex, until))
FORBID(int, pthread_create,
       (pthread_t * out, const pthread_attr_t *attributes, void *(*run)(void *), void *argument),
       (out, attributes, run, argument))
FORBID(int, pthread_join, (pthread_t thread, void **result), (thread, result))
FORBID(int, sem_wait, (sem_t * semaphore), (semaphore)) /* nothing bounds it */

FORBID(void *, mmap, (void *at, size_t size, int rights, int flags, int fd, off_t offset),
       (at, size, rights, flags, fd, offset))
FORBID(int, munmap, (void *at, size_t size), (at, size))
FORBID(int, mprotect, (void *at, size_t size, int rights), (at, size, rights))

FORBID(int, nanosleep, (const struct timespec *wanted, struct timespec *left), (wanted, left))
FORBID(int, usleep, (useconds_t us), (us))
FORBID(unsigned, sleep, (unsigned seconds), (seconds))
FORBID(int, close, (int fd), (fd))
FORBID(ssize_t, read, (int fd, void *bytes, size_t size), (fd, bytes, size))
FORBID(ssize_t, write, (int fd, const void *bytes, size_t size), (fd, bytes, size))
FORBID(ssize_t, pread, (int fd, void *bytes, size_t size, off_t at), (fd, bytes, size, at))
FORBID(ssize_t, pwrite, (int fd, const void *bytes, size_t size, off_t at), (fd, bytes, size, at))

FORBID(FILE *, fopen, (const char *path, const char *mode), (path, mode))
FORBID(int, fclose, (FILE * file), (file))
FORBID(int, fflush, (FILE * file), (file))
FORBID(int, puts, (const char *text), (text))
FORBID(int, putchar, (int character), (character))
FORBID(int, fputs, (const char *text, FILE *file), (text, file))
FORBID(int, fputc, (int character, FILE *file), (character, file))
FORBID(void, perror, (const char *text), (text))
FORBID(size_t, fwrite, (const void *items, size_t size, size_t count, FILE *file),
       (items, size, count, file))
FORBID(size_t, fread, (void *items, size_t size, size_t count, FILE *file),
       (items, size, count, file))
FORBID(int, vfprintf, (FILE * file, const char *format, va_list args), (file, format, args))
FORBID(int, vprintf, (const char *format, va_list args), (format, args))
FORBID(void, vsyslog, (int priority, const char *format, va_list args), (priority, format, args))

int printf(const char *format, ...)
{
	va_list args;

	check("printf");
	va_start(args, format);
	int written = vprintf(format, args);
	va_end(args);
	return written;
}

int fprintf(FILE *file, const char *format, ...)
{
	va_list args;

	check("fprintf");
	va_start(args, format);
	int written = vfprintf(file, format, args);
	va_end(args);
	return written;
}

void syslog(int priority, const char *format, ...)
{
	va_list args;

	check("syslog");
	va_start(args, format);
	vsyslog(priority, format, args);
	va_end(args);
}

/* A mode comes with O_CREAT and O_TMPFILE alone; reading it without is harmless where it is an
 * argument in a register. */
int open(const char *path, int flags, ...)
{
	va_list args;

	check("open");
	va_start(args, flags);
	mode_t mode = va_arg(args, mode_t);
	va_end(args);
	return openat(AT_FDCWD, path, flags, mode);
}

int openat(int dir_fd, const char *path, int flags, ...)
{
	va_list args;

	check("openat");
	va_start(args, flags);
	mode_t mode = va_arg(args, mode_t);
	va_end(args);
	return (int)syscall(SYS_openat, dir_fd, path, flags, mode);
}

/* Programs built for large files call these names; the arguments are the same. */
int open64(const char *path, int flags, ...) __attribute__((alias("open")));
int openat64(int dir_fd, const char *path, int flags, ...) __attribute__((alias("openat")));
FILE *fopen64(const char *path, const char *mode) __attribute__((alias("fopen")));
void *mmap64(void *at, size_t size, int rights, int flags, int fd, off_t offset)
	__attribute__((alias("mmap")));
ssize_t pread64(int fd, void *bytes, size_t size, off_t at) __attribute__((alias("pread")));
ssize_t pwrite64(int fd, const void *bytes, size_t size, off_t at) __attribute__((alias("pwrite")));
