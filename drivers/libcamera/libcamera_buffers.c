/*
 * Mapping dmabufs. One may hold several planes: of ours the first, at an offset that need not be a
 * page's.
 */
#include "drivers/libcamera/libcamera_buffers.h"

#include <errno.h>
#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

static int map_buffer(const struct libcamera_plane *plane, struct libcamera_buffer *buffer)
{
	size_t map_bytes = plane->offset_bytes + plane->size_bytes;
	void *map = mmap(NULL, map_bytes, PROT_READ, MAP_SHARED, plane->fd, 0);

	if (map == MAP_FAILED)
		return -errno;
	*buffer = (struct libcamera_buffer){.pixels = (const uint8_t *)map + plane->offset_bytes,
					    .size_bytes = plane->size_bytes,
					    .map = map,
					    .map_bytes = map_bytes,
					    .fd = plane->fd};
	return 0;
}

int libcamera_map_buffers(const struct libcamera_device *device, uint32_t count, size_t least_bytes,
			  struct libcamera_buffers *buffers)
{
	int error = 0;

	for (uint32_t i = 0; i < count && !error; i++) {
		struct libcamera_plane plane = libcamera_shim_plane(device, i);

		error = plane.size_bytes < least_bytes ? -EMSGSIZE
						       : map_buffer(&plane, &buffers->buffers[i]);
		buffers->count = error ? i : i + 1;
	}
	if (error)
		libcamera_unmap_buffers(buffers);
	return error;
}

void libcamera_unmap_buffers(struct libcamera_buffers *buffers)
{
	for (uint32_t i = 0; i < buffers->count; i++)
		munmap(buffers->buffers[i].map, buffers->buffers[i].map_bytes);
	buffers->count = 0;
}

void libcamera_sync_buffer(const struct libcamera_buffers *buffers, uint32_t buffer, uint64_t phase)
{
	struct dma_buf_sync sync = {.flags = DMA_BUF_SYNC_READ | phase};

	ioctl(buffers->buffers[buffer].fd, DMA_BUF_IOCTL_SYNC, &sync);
}
