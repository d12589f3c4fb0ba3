/*
 * The files by which gpio-sim shows and drives its lines.
 */
#include "tests/hil/gpio_sim.h"

#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static int open_file(const char *device, unsigned int offset, const char *name, int flags)
{
	char pattern[160];
	glob_t found;

	snprintf(pattern, sizeof(pattern), "%s/gpiochip*/sim_gpio%u/%s", device, offset, name);
	if (glob(pattern, 0, NULL, &found))
		return -ENODEV;
	int fd = open(found.gl_pathv[0], flags | O_CLOEXEC);
	int err = -errno;

	globfree(&found);
	return fd < 0 ? err : fd;
}

int gpio_sim_level(const char *device, unsigned int offset)
{
	char digit;
	int fd = open_file(device, offset, "value", O_RDONLY);

	if (fd < 0)
		return fd;
	int level = read(fd, &digit, 1) == 1 ? digit == '1' : -EIO;

	close(fd);
	return level;
}

int gpio_sim_drive(const char *device, unsigned int offset, bool high)
{
	const char *pull = high ? "pull-up" : "pull-down";
	int fd = open_file(device, offset, "pull", O_WRONLY);

	if (fd < 0)
		return fd;
	int err = write(fd, pull, strlen(pull)) < 0 ? -errno : 0;

	close(fd);
	return err;
}
