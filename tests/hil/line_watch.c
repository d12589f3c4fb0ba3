/*
 * Reads the event gpio_value from a trace of its own.
 */
#include "tests/hil/line_watch.h"

#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"

#define INSTANCES "/sys/kernel/tracing/instances"

/* The machine's number of the first line of a device's chip. */
static int read_base(const char *device, unsigned int *out)
{
	char pattern[160];
	glob_t found;
	int err = -ENODEV;

	snprintf(pattern, sizeof(pattern), "%s/gpio/gpiochip*/base", device);
	if (glob(pattern, 0, NULL, &found))
		return err;
	FILE *file = fopen(found.gl_pathv[0], "r");

	if (file && fscanf(file, "%u", out) == 1)
		err = 0;
	if (file)
		fclose(file);
	globfree(&found);
	return err;
}

static int set(const struct line_watch *watch, const char *name, const char *value)
{
	char path[160];

	snprintf(path, sizeof(path), "%s/%s", watch->instance, name);
	int fd = open(path, O_WRONLY | O_CLOEXEC);

	if (fd < 0)
		return -errno;
	int err = write(fd, value, strlen(value)) < 0 ? -errno : 0;

	close(fd);
	return err;
}

static int start(struct line_watch *watch)
{
	char text[160];
	int err = set(watch, "trace_clock", "mono");

	if (err)
		return err;
	snprintf(text, sizeof(text), "gpio == %u && get == 0", watch->number);
	err = set(watch, "events/gpio/gpio_value/filter", text);
	if (!err)
		err = set(watch, "events/gpio/gpio_value/enable", "1");
	if (err)
		return err;
	snprintf(text, sizeof(text), "%s/trace_pipe", watch->instance);
	watch->fd = open(text, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
	return watch->fd < 0 ? -errno : 0;
}

int line_watch_open(struct line_watch *watch, const char *device, unsigned int offset)
{
	unsigned int base;
	int err = read_base(device, &base);

	if (err)
		return err;
	*watch = (struct line_watch){.fd = -1, .number = base + offset};
	snprintf(watch->instance, sizeof(watch->instance), INSTANCES "/line%u-%d", watch->number,
		 (int)getpid());
	if (mkdir(watch->instance, 0700))
		return -errno;
	err = start(watch);
	if (err)
		line_watch_close(watch);
	return err;
}

void line_watch_close(struct line_watch *watch)
{
	if (watch->fd >= 0)
		close(watch->fd);
	rmdir(watch->instance);
}

/* Takes the first line of the text, "task-pid [cpu] flags seconds: gpio_value: number set level".
 * False when there is no whole line; one of something else leaves `out->time_ns` at 0. */
static bool take_line(struct line_watch *watch, struct line_change *out)
{
	char *end = memchr(watch->text, '\n', watch->text_bytes);
	uint64_t seconds, microseconds;
	int level;

	if (!end)
		return false;
	*end = '\0';
	*out = (struct line_change){0};
	char *event = strstr(watch->text, ": gpio_value: ");

	if (event) {
		char *time = event;

		while (time > watch->text && time[-1] != ' ')
			time--;
		if (sscanf(time, "%" SCNu64 ".%6" SCNu64 ": gpio_value: %*u set %d", &seconds,
			   &microseconds, &level) == 3)
			*out = (struct line_change){.level = level != 0,
						    .time_ns = (int64_t)seconds * NS_PER_S +
							       (int64_t)microseconds * NS_PER_US};
	}
	watch->text_bytes -= (size_t)(end + 1 - watch->text);
	memmove(watch->text, end + 1, watch->text_bytes);
	return true;
}

int line_watch_next(struct line_watch *watch, int timeout_ms, struct line_change *out)
{
	struct line_change change;

	for (;;) {
		while (take_line(watch, &change))
			if (change.time_ns) {
				*out = change;
				return 0;
			}
		struct pollfd wanted = {.fd = watch->fd, .events = POLLIN};
		int ready = poll(&wanted, 1, timeout_ms);

		if (ready <= 0)
			return ready ? -errno : -ETIMEDOUT;
		ssize_t bytes = read(watch->fd, watch->text + watch->text_bytes,
				     sizeof(watch->text) - watch->text_bytes);

		if (bytes < 0 && errno != EAGAIN)
			return -errno;
		watch->text_bytes += bytes > 0 ? (size_t)bytes : 0;
	}
}
