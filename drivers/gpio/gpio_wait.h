/*
 * What both versions of gpio_lines share: waiting for the kernel to hand over an edge.
 */
#pragma once

#include <stdint.h>

/* Until `fd` is readable: 0, -ETIMEDOUT at `until_ns`, -ENODEV when its device is gone. Real-time
 * safe: it waits for nothing but its own device. */
int gpio_fd_wait(int fd, int64_t until_ns);
