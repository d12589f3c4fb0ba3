/*
 * The device's buffers: the kernel makes them, they are mapped here once and read in place.
 */
#include <errno.h>
#include <sys/mman.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2_device.h"

#define POOL_NS (250 * NS_PER_MS) /* a capture thread may stall this long */
#define POOL_MIN 6

void v4l2_unmap_buffers(const struct v4l2_device *device, struct v4l2_buffers *buffers)
{
	struct v4l2_requestbuffers none = {.type = device->type, .memory = V4L2_MEMORY_MMAP};

	for (uint32_t i = 0; i < buffers->count; i++)
		munmap(buffers->pixels[i], buffers->size_bytes[i]);
	if (buffers->count)
		v4l2_ask(device->fd, VIDIOC_REQBUFS, &none);
	buffers->count = 0;
}

static int map_buffer(const struct v4l2_device *device, struct v4l2_buffers *buffers,
		      uint32_t index, size_t least_bytes)
{
	struct v4l2_place place;
	int error = v4l2_query_buffer(device, index, &place);

	if (error)
		return error;
	if (place.size_bytes < least_bytes)
		return -EMSGSIZE;
	void *pixels = mmap(NULL, place.size_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, device->fd,
			    place.offset_bytes);

	if (pixels == MAP_FAILED)
		return -errno;
	buffers->pixels[index] = pixels;
	buffers->size_bytes[index] = place.size_bytes;
	buffers->count = index + 1;
	return 0;
}

static uint32_t pool_size(int64_t period_ns)
{
	int64_t count = period_ns > 0 ? POOL_NS / period_ns + 2 : 0;

	return (uint32_t)(count < POOL_MIN          ? POOL_MIN
			  : count > VIDEO_MAX_FRAME ? VIDEO_MAX_FRAME
						    : count);
}

int v4l2_map_buffers(const struct v4l2_device *device, int64_t period_ns, size_t least_bytes,
		     struct v4l2_buffers *buffers, struct diag *diag)
{
	struct v4l2_requestbuffers request = {
		.count = pool_size(period_ns), .type = device->type, .memory = V4L2_MEMORY_MMAP};
	int error = v4l2_ask(device->fd, VIDIOC_REQBUFS, &request);

	if (!error && request.count < 2)
		error = -ENOMEM;
	for (uint32_t i = 0; i < request.count && i < VIDEO_MAX_FRAME && !error; i++)
		error = map_buffer(device, buffers, i, least_bytes);
	if (!error)
		return 0;
	v4l2_unmap_buffers(device, buffers);
	return v4l2_fail(device, error, "buffers", diag);
}
