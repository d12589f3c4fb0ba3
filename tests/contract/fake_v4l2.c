/*
 * V4L2 cameras that are files. Linked into a test, or preloaded into a program, it stands between
 * the program and the kernel: /dev/videoN and the kernel's tree in /sys are looked for below
 * $FAKE_V4L2, and a file dev/videoN there, lines of "key value", is a camera that streams (the keys
 * are those of struct fake). Taking the file away pulls the plug. The first eight bytes of a
 * picture (of YUYV: of its luma) are the true middle of its exposure. Files are 64-bit: open is
 * open64.
 */
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "tests/contract/fake_v4l2_parts.h"

struct fake fakes[FAKES_MAX];
static atomic_flag lock = ATOMIC_FLAG_INIT;

void fake_lock(void)
{
	const struct timespec a_while = {.tv_nsec = 20000}; /* who has it may need this processor */

	while (atomic_flag_test_and_set(&lock))
		syscall(SYS_clock_nanosleep, CLOCK_MONOTONIC, 0, &a_while, NULL);
}

void fake_unlock(void)
{
	atomic_flag_clear(&lock);
}

static int fail(int error)
{
	errno = error;
	return -1;
}

static const char *root(void)
{
	return getenv("FAKE_V4L2");
}

static bool begins(const char *path, const char *with)
{
	return root() && strncmp(path, with, strlen(with)) == 0;
}

static struct fake *find(int fd)
{
	for (int i = 0; i < FAKES_MAX && fd > 0; i++)
		if (fakes[i].fd == fd)
			return &fakes[i];
	return NULL;
}

static int open_fake(const char *path)
{
	struct fake made = {0};
	int i = 0;

	snprintf(made.path, sizeof(made.path), "%s%s", root(), path);
	if (access(made.path, F_OK))
		return fail(ENOENT);
	if (!fake_read_settings(&made) || made.denied)
		return fail(EACCES);
	made.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE);
	fake_lock();
	while (i < FAKES_MAX && fakes[i].fd)
		i++;
	if (i < FAKES_MAX)
		fakes[i] = made;
	fake_unlock();
	return i < FAKES_MAX ? made.fd : fail(EMFILE);
}

int open64(const char *path, int flags, ...)
{
	char below[600];
	va_list arguments;

	va_start(arguments, flags);
	mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;

	va_end(arguments);
	if (begins(path, "/dev/video"))
		return open_fake(path);
	if (begins(path, "/sys/class/video4linux") || begins(path, "/sys/module/uvcvideo")) {
		snprintf(below, sizeof(below), "%s%s", root(), path);
		path = below;
	}
	return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

int scandir64(const char *path, struct dirent64 ***entries, int (*filter)(const struct dirent64 *),
	      int (*order)(const struct dirent64 **, const struct dirent64 **))
{
	static int (*next)(const char *, struct dirent64 ***, int (*)(const struct dirent64 *),
			   int (*)(const struct dirent64 **, const struct dirent64 **));
	char below[600];

	if (!next)
		*(void **)&next = dlsym(RTLD_NEXT, "scandir64");
	snprintf(below, sizeof(below), "%s%s", begins(path, "/sys/class/video4linux") ? root() : "",
		 path);
	return next(below, entries, filter, order);
}

int open(const char *path, int flags, ...) __attribute__((alias("open64")));
int scandir(const char *path, struct dirent ***entries, int (*filter)(const struct dirent *),
	    int (*order)(const struct dirent **, const struct dirent **))
	__attribute__((alias("scandir64")));

int ioctl(int fd, unsigned long request, ...)
{
	va_list arguments;

	va_start(arguments, request);
	void *argument = va_arg(arguments, void *);

	va_end(arguments);
	struct fake *fake = find(fd);

	if (!fake)
		return (int)syscall(SYS_ioctl, fd, request, argument);
	if (request == VIDIOC_STREAMOFF)
		fake_stop(fake);
	fake_lock();
	int result = fake_answer(fake, request, argument);

	fake_unlock();
	return result;
}

void *mmap64(void *at, size_t size_bytes, int protection, int flags, int fd, off64_t offset)
{
	const struct fake *fake = find(fd);

	return (void *)syscall(SYS_mmap, at, size_bytes, protection, flags,
			       fake ? fake->memory_fd : fd, offset);
}

void *mmap(void *at, size_t size_bytes, int protection, int flags, int fd, off_t offset)
	__attribute__((alias("mmap64")));

int close(int fd)
{
	struct fake *fake = find(fd);

	if (fake) {
		fake_stop(fake);
		if (fake->memory) {
			munmap(fake->memory, (size_t)fake->size_bytes * fake->buffer_count);
			syscall(SYS_close, fake->memory_fd);
		}
		memset(fake, 0, sizeof(*fake));
	}
	return (int)syscall(SYS_close, fd);
}
