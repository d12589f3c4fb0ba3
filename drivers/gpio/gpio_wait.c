/*
 * poll() with an end that is a time.
 */
#include "drivers/gpio/gpio_wait.h"

#include <errno.h>
#include <poll.h>
#include <time.h>

#include "base/clock.h"

int gpio_fd_wait(int fd, int64_t until_ns)
{
	struct pollfd polled = {.fd = fd, .events = POLLIN};
	int64_t left_ns = until_ns - clock_now_ns();
	struct timespec left = {0};

	if (left_ns > 0)
		left = (struct timespec){left_ns / NS_PER_S, left_ns % NS_PER_S};
	int ready = ppoll(&polled, 1, &left, NULL);
	if (ready < 0)
		return errno == EINTR ? -ETIMEDOUT : -errno;
	if (ready == 0)
		return -ETIMEDOUT;
	return polled.revents & POLLIN ? 0 : -ENODEV;
}
