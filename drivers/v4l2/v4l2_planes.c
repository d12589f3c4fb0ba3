/*
 * The kernel has two APIs for pictures: one for those that lie in one memory plane, and one for
 * those that may lie in several. Devices of the second kind serve too, as long as their pictures
 * lie in one plane; nothing outside this file sees which kind it is.
 */
#include <errno.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2_device.h"

/* As the kernel is asked: `about` points to `plane` where the device is of the second kind. */
struct exchange {
	struct v4l2_buffer about;
	struct v4l2_plane plane;
};

static bool has_planes(const struct v4l2_device *device)
{
	return device->type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
}

static int ask_buffer(const struct v4l2_device *device, unsigned long request, uint32_t index,
		      struct exchange *out)
{
	*out = (struct exchange){
		.about = {.index = index, .type = device->type, .memory = V4L2_MEMORY_MMAP}};
	if (has_planes(device)) {
		out->about.m.planes = &out->plane;
		out->about.length = 1;
	}
	return v4l2_ask(device->fd, request, &out->about);
}

int v4l2_query_buffer(const struct v4l2_device *device, uint32_t index, struct v4l2_place *out)
{
	struct exchange asked;
	int error = ask_buffer(device, VIDIOC_QUERYBUF, index, &asked);

	if (error)
		return error;
	*out = has_planes(device)
		       ? (struct v4l2_place){asked.plane.m.mem_offset, asked.plane.length}
		       : (struct v4l2_place){asked.about.m.offset, asked.about.length};
	return 0;
}

int v4l2_queue(const struct v4l2_device *device, uint32_t index)
{
	struct exchange asked;

	return ask_buffer(device, VIDIOC_QBUF, index, &asked);
}

int v4l2_dequeue(const struct v4l2_device *device, struct v4l2_filled *out)
{
	struct exchange asked;
	int error = ask_buffer(device, VIDIOC_DQBUF, 0, &asked);

	if (error)
		return error;
	*out = (struct v4l2_filled){
		.index = asked.about.index,
		.flags = asked.about.flags,
		.sequence = asked.about.sequence,
		.used_bytes = has_planes(device) ? asked.plane.bytesused : asked.about.bytesused,
		.offset_bytes = has_planes(device) ? asked.plane.data_offset : 0,
		.stamp_ns = (int64_t)asked.about.timestamp.tv_sec * NS_PER_S +
			    (int64_t)asked.about.timestamp.tv_usec * NS_PER_US,
	};
	return 0;
}

int v4l2_ask_format(const struct v4l2_device *device, unsigned long request,
		    struct v4l2_pix_format *pix, uint32_t *plane_count)
{
	struct v4l2_format format = {.type = device->type};
	struct v4l2_pix_format_mplane *planes = &format.fmt.pix_mp;

	if (!has_planes(device)) {
		format.fmt.pix = *pix;
	} else {
		planes->width = pix->width;
		planes->height = pix->height;
		planes->pixelformat = pix->pixelformat;
		planes->field = pix->field;
		planes->num_planes = 1;
	}
	int error = v4l2_ask(device->fd, request, &format);

	if (error)
		return error;
	*plane_count = has_planes(device) ? planes->num_planes : 1;
	*pix = !has_planes(device) ? format.fmt.pix
				   : (struct v4l2_pix_format){
					     .width = planes->width,
					     .height = planes->height,
					     .pixelformat = planes->pixelformat,
					     .field = planes->field,
					     .bytesperline = planes->plane_fmt[0].bytesperline,
					     .sizeimage = planes->plane_fmt[0].sizeimage,
				     };
	return 0;
}
