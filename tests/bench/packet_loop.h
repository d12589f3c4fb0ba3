/*
 * The yardstick of bench-ingest: the least that a program does to have a GigE Vision camera's
 * frames in memory. One thread, blocking recvmmsg, every packet's pixels straight into the frame at
 * the place where the next packet belongs; nothing is copied, nothing is polled.
 */
#pragma once

#include <stdint.h>

struct packet_loop_result {
	int64_t cpu_ns; /* of the receiving thread, for these frames */
	uint64_t whole, damaged;
	uint64_t calls; /* of recvmmsg */
};

/* Takes control of the camera at `ip`, which sends packets of `packet_bytes`; receives `warm_up`
 * frames, then `frames` that count, into `buffers` frame buffers in turn. 0 or a negative errno. */
int packet_loop_run(struct packet_loop_result *out, const char *ip, unsigned int packet_bytes,
		    uint32_t buffers, uint64_t warm_up, uint64_t frames);
