/*
 * A stream's buffers, which are dmabufs of the kernel's: mapped once and read in place.
 */
#pragma once

#include "drivers/libcamera/libcamera_shim.h"

struct libcamera_buffer {
	const uint8_t *pixels; /* the kernel's */
	size_t size_bytes;     /* of the picture's plane */
	void *map;
	size_t map_bytes;
	int fd; /* libcamera's */
};

struct libcamera_buffers {
	uint32_t count;
	struct libcamera_buffer buffers[LIBCAMERA_BUFFERS_MAX];
};

/* Into zeroed `buffers`; -EMSGSIZE where one is smaller than `least_bytes`, or another negative
 * errno. Control thread. */
int libcamera_map_buffers(const struct libcamera_device *device, uint32_t count, size_t least_bytes,
			  struct libcamera_buffers *buffers);
void libcamera_unmap_buffers(struct libcamera_buffers *buffers);

/* Around reading: DMA_BUF_SYNC_START and DMA_BUF_SYNC_END, for processors whose caches do not see
 * what a device writes. Real-time safe. */
void libcamera_sync_buffer(const struct libcamera_buffers *buffers, uint32_t buffer,
			   uint64_t phase);
