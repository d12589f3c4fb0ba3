/*
 * What a fake camera answers to each ioctl.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "tests/contract/fake_v4l2_parts.h"

static struct {
	uint32_t id, type, flags;
	const char *name;
	int64_t min, max, own, value;
} controls[] = {
	{V4L2_CID_GAIN, V4L2_CTRL_TYPE_INTEGER, 0, "Gain", 0, 255, 64, 64},
	{V4L2_CID_CAMERA_CLASS, V4L2_CTRL_TYPE_CTRL_CLASS,
	 V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_WRITE_ONLY, "Camera Controls", 0, 0, 0, 0},
	{V4L2_CID_EXPOSURE_AUTO, V4L2_CTRL_TYPE_MENU, 0, "Auto Exposure", 0, 3, 3, 3},
	{V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CTRL_TYPE_INTEGER, 0, "Exposure Time, Absolute", 1, 5000,
	 156, 156},
	{V4L2_CID_PRIVACY, V4L2_CTRL_TYPE_BOOLEAN, V4L2_CTRL_FLAG_READ_ONLY, "Privacy", 0, 1, 0, 0},
	{V4L2_CID_CAMERA_CLASS_BASE + 0x1000, V4L2_CTRL_TYPE_BOOLEAN, 0, "Trigger Mode", 0, 1, 0,
	 0},
};

#define CONTROL_COUNT (sizeof(controls) / sizeof(controls[0]))

static int fail(int error)
{
	errno = error;
	return -1;
}

static int query_capability(const struct fake *fake, struct v4l2_capability *about)
{
	uint32_t capture = fake->planes ? V4L2_CAP_VIDEO_CAPTURE_MPLANE : V4L2_CAP_VIDEO_CAPTURE;

	*about = (struct v4l2_capability){.capabilities = V4L2_CAP_DEVICE_CAPS | capture};
	snprintf((char *)about->card, sizeof(about->card), "%.31s", fake->card);
	snprintf((char *)about->driver, sizeof(about->driver), "%.15s", fake->driver);
	about->device_caps = fake->metadata ? V4L2_CAP_META_CAPTURE : capture;
	if (!fake->cannot_stream)
		about->device_caps |= V4L2_CAP_STREAMING;
	return 0;
}

static int enumerate_formats(const struct fake *fake, struct v4l2_fmtdesc *about)
{
	const char *format = fake_nth_format(fake, about->index);

	if (!format)
		return fail(EINVAL);
	about->pixelformat = fake_fourcc(format);
	return 0;
}

static int enumerate_sizes(const struct fake *fake, struct v4l2_frmsizeenum *size)
{
	if (size->index > 1)
		return fail(EINVAL);
	size->type = V4L2_FRMSIZE_TYPE_DISCRETE;
	size->discrete.width =
		(uint32_t)fake->full_width >> (1 - size->index); /* a half, then all */
	size->discrete.height = (uint32_t)fake->full_height >> (1 - size->index);
	return 0;
}

/* Half the size goes at 500 Hz, the whole at 200. */
static int enumerate_rates(const struct fake *fake, struct v4l2_frmivalenum *rate)
{
	bool whole = rate->width == (uint32_t)fake->full_width;

	if (rate->index > 1)
		return fail(EINVAL);
	rate->type = V4L2_FRMIVAL_TYPE_DISCRETE;
	rate->discrete = (struct v4l2_fract){1, rate->index == 0 ? 30 : whole ? 200 : 500};
	return 0;
}

static void tell_format(const struct fake *fake, struct v4l2_pix_format *pix)
{
	*pix = (struct v4l2_pix_format){
		.width = (uint32_t)fake->width,
		.height = (uint32_t)fake->height,
		.pixelformat = fake->fourcc,
		.field = V4L2_FIELD_NONE,
		.bytesperline = fake->fourcc == V4L2_PIX_FMT_MJPEG ? 0 : (uint32_t)fake->stride,
		.sizeimage = fake->size_bytes,
	};
}

/* Another open file has the buffers of this camera. */
static bool is_busy(const struct fake *fake)
{
	if (fake->busy)
		return true;
	for (int i = 0; i < FAKES_MAX; i++)
		if (&fakes[i] != fake && fakes[i].fd && fakes[i].buffer_count &&
		    strcmp(fakes[i].path, fake->path) == 0)
			return true;
	return false;
}

static int set_wanted_format(struct fake *fake, struct v4l2_pix_format *pix)
{
	if (is_busy(fake) || fake->buffer_count)
		return fail(EBUSY);
	long half = pix->width == (uint32_t)fake->full_width / 2;

	fake->width = fake->full_width >> half;
	fake->height = fake->full_height >> half;
	for (uint32_t i = 0; fake_nth_format(fake, i); i++)
		if (fake_fourcc(fake_nth_format(fake, i)) == pix->pixelformat)
			fake_set_format(fake, pix->pixelformat);
	tell_format(fake, pix);
	return 0;
}

/* As the API for several planes has it: all of them are alike. */
static int exchange_planes(struct fake *fake, struct v4l2_pix_format_mplane *planes, bool set)
{
	struct v4l2_pix_format pix = {.width = planes->width,
				      .height = planes->height,
				      .pixelformat = planes->pixelformat};
	int result = set ? set_wanted_format(fake, &pix) : 0;

	if (result)
		return result;
	tell_format(fake, &pix);
	*planes = (struct v4l2_pix_format_mplane){
		.width = pix.width,
		.height = pix.height,
		.pixelformat = pix.pixelformat,
		.field = pix.field,
		.num_planes = (uint8_t)fake->planes,
	};
	for (long p = 0; p < fake->planes; p++) {
		planes->plane_fmt[p].bytesperline = pix.bytesperline;
		planes->plane_fmt[p].sizeimage = pix.sizeimage;
	}
	return 0;
}

static int exchange_format(struct fake *fake, struct v4l2_format *format, bool set)
{
	if (fake->planes)
		return exchange_planes(fake, &format->fmt.pix_mp, set);
	if (set)
		return set_wanted_format(fake, &format->fmt.pix);
	tell_format(fake, &format->fmt.pix);
	return 0;
}

/* Rates of 1 / whole milliseconds only. */
static int set_interval(struct fake *fake, struct v4l2_captureparm *parm, bool set)
{
	const struct v4l2_fract *wanted = &parm->timeperframe;

	if (set && wanted->denominator)
		fake->period_us = ((long)wanted->numerator * 1000 / (long)wanted->denominator +
				   (wanted->numerator * 1000ul % wanted->denominator > 0)) *
				  1000;
	*parm = (struct v4l2_captureparm){
		.capability = V4L2_CAP_TIMEPERFRAME,
		.timeperframe = {(uint32_t)fake->period_us, 1000000},
	};
	return 0;
}

static int query_control(struct v4l2_query_ext_ctrl *query)
{
	bool next = query->id & V4L2_CTRL_FLAG_NEXT_CTRL;
	uint32_t id = query->id & ~V4L2_CTRL_FLAG_NEXT_CTRL;

	for (size_t c = 0; c < CONTROL_COUNT; c++) {
		if (next ? controls[c].id <= id : controls[c].id != id)
			continue;
		*query = (struct v4l2_query_ext_ctrl){
			.id = controls[c].id,
			.type = controls[c].type,
			.flags = controls[c].flags,
			.minimum = controls[c].min,
			.maximum = controls[c].max,
			.default_value = controls[c].own,
		};
		strcpy(query->name, controls[c].name);
		return 0;
	}
	return fail(EINVAL);
}

static int exchange_control(struct fake *fake, struct v4l2_ext_controls *all, bool set)
{
	uint32_t id = all->controls->id;

	if (!set && id == V4L2_CID_HBLANK && fake->pixel_rate) {
		all->controls->value = (int32_t)fake->hblank;
		return 0;
	}
	if (!set && id == V4L2_CID_PIXEL_RATE && fake->pixel_rate) {
		all->controls->value64 = fake->pixel_rate;
		return 0;
	}
	for (size_t c = 0; c < CONTROL_COUNT; c++)
		if (controls[c].id == all->controls->id) {
			if (set)
				controls[c].value = all->controls->value;
			if (set && controls[c].id == V4L2_CID_EXPOSURE_ABSOLUTE)
				fake->exposure_us = 100L * all->controls->value;
			all->controls->value = (int32_t)controls[c].value;
			return 0;
		}
	return fail(EINVAL);
}

static int request_buffers(struct fake *fake, struct v4l2_requestbuffers *request)
{
	if (is_busy(fake) || fake->streams)
		return fail(EBUSY);
	if (fake->memory) {
		munmap(fake->memory, (size_t)fake->size_bytes * fake->buffer_count);
		close(fake->memory_fd);
		fake->memory = NULL;
	}
	fake->buffer_count = request->count < BUFFERS_MAX ? request->count : BUFFERS_MAX;
	request->count = fake->buffer_count;
	if (!fake->buffer_count)
		return 0;
	/* offsets of maps are pages, so are buffers */
	fake->size_bytes = (fake->size_bytes + 4095) / 4096 * 4096;
	size_t bytes = (size_t)fake->size_bytes * fake->buffer_count;

	fake->memory_fd = memfd_create("fake-v4l2", MFD_CLOEXEC);
	if (fake->memory_fd < 0 || ftruncate(fake->memory_fd, (off_t)bytes))
		return fail(ENOMEM);
	fake->memory = (uint8_t *)syscall(SYS_mmap, NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED,
					  fake->memory_fd, 0L);
	return 0;
}

static int query_buffer(const struct fake *fake, struct v4l2_buffer *about)
{
	if (about->index >= fake->buffer_count)
		return fail(EINVAL);
	if (fake->planes) {
		about->m.planes->length = fake->size_bytes;
		about->m.planes->m.mem_offset = about->index * fake->size_bytes;
	} else {
		about->length = fake->size_bytes;
		about->m.offset = about->index * fake->size_bytes;
	}
	return 0;
}

static int queue_buffer(struct fake *fake, const struct v4l2_buffer *about)
{
	struct fake_buffer *buffer = &fake->buffers[about->index];

	if (fake->gone)
		return fail(ENODEV);
	if (about->index >= fake->buffer_count || buffer->state != FREE)
		return fail(EINVAL);
	buffer->state = QUEUED;
	buffer->about.index = about->index;
	fake->fifo[fake->fifo_count++] = about->index;
	return 0;
}

static int dequeue_buffer(struct fake *fake, struct v4l2_buffer *about)
{
	eventfd_t count;

	if (fake->gone)
		return fail(fake->quiet ? EAGAIN : ENODEV);
	if (!fake->streams)
		return fail(EINVAL);
	if (fake->eio_after && fake->sequence > fake->eio_after)
		return fail(EIO);
	if (!fake->done_count)
		return fail(EAGAIN);
	eventfd_read(fake->fd, &count);
	uint32_t index = fake->done[0];

	memmove(fake->done, fake->done + 1, --fake->done_count * sizeof(fake->done[0]));
	fake->buffers[index].state = FREE;
	struct v4l2_buffer *done = &fake->buffers[index].about;

	about->index = index;
	if (fake->planes) {
		about->m.planes->bytesused = done->bytesused;
		about->m.planes->data_offset = (uint32_t)fake->offset;
	} else {
		about->bytesused = done->bytesused;
	}
	about->flags = done->flags;
	about->timestamp = done->timestamp;
	about->sequence = done->sequence;
	return 0;
}

static int stream_on(struct fake *fake)
{
	if (fake->gone)
		return fail(ENODEV);
	fake->streams = true;
	return fake_start(fake);
}

static int stream_off(struct fake *fake)
{
	eventfd_t count;

	fake->streams = false;
	fake->fifo_count = fake->done_count = 0;
	for (int i = 0; i < BUFFERS_MAX; i++)
		fake->buffers[i].state = FREE;
	while (eventfd_read(fake->fd, &count) == 0)
		;
	return 0;
}

/* Of the API that the camera has, where a request names one; buffers come with their planes. */
static bool is_ours(const struct fake *fake, unsigned long request, const void *argument)
{
	uint32_t ours =
		fake->planes ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
	const struct v4l2_buffer *buffer = argument;

	switch (request) {
	case VIDIOC_ENUM_FMT:
		return ((const struct v4l2_fmtdesc *)argument)->type == ours;
	case VIDIOC_G_FMT:
	case VIDIOC_S_FMT:
		return ((const struct v4l2_format *)argument)->type == ours;
	case VIDIOC_G_PARM:
	case VIDIOC_S_PARM:
		return ((const struct v4l2_streamparm *)argument)->type == ours;
	case VIDIOC_REQBUFS:
		return ((const struct v4l2_requestbuffers *)argument)->type == ours;
	case VIDIOC_QUERYBUF:
	case VIDIOC_QBUF:
	case VIDIOC_DQBUF:
		return buffer->type == ours &&
		       (!fake->planes ||
			(buffer->m.planes && buffer->length >= (uint32_t)fake->planes));
	case VIDIOC_STREAMON:
	case VIDIOC_STREAMOFF:
		return *(const uint32_t *)argument == ours;
	default:
		return true;
	}
}

int fake_answer(struct fake *fake, unsigned long request, void *argument)
{
	if (fake->gone && request != VIDIOC_DQBUF)
		return fail(ENODEV);
	if (!is_ours(fake, request, argument))
		return fail(EINVAL);
	switch (request) {
	case VIDIOC_QUERYCAP:
		return query_capability(fake, argument);
	case VIDIOC_ENUM_FMT:
		return enumerate_formats(fake, argument);
	case VIDIOC_ENUM_FRAMESIZES:
		return enumerate_sizes(fake, argument);
	case VIDIOC_ENUM_FRAMEINTERVALS:
		return enumerate_rates(fake, argument);
	case VIDIOC_G_FMT:
	case VIDIOC_S_FMT:
		return exchange_format(fake, argument, request == VIDIOC_S_FMT);
	case VIDIOC_G_PARM:
	case VIDIOC_S_PARM:
		return set_interval(fake, &((struct v4l2_streamparm *)argument)->parm.capture,
				    request == VIDIOC_S_PARM);
	case VIDIOC_QUERY_EXT_CTRL:
		return query_control(argument);
	case VIDIOC_G_EXT_CTRLS:
	case VIDIOC_S_EXT_CTRLS:
		return exchange_control(fake, argument, request == VIDIOC_S_EXT_CTRLS);
	case VIDIOC_REQBUFS:
		return request_buffers(fake, argument);
	case VIDIOC_QUERYBUF:
		return query_buffer(fake, argument);
	case VIDIOC_QBUF:
		return queue_buffer(fake, argument);
	case VIDIOC_DQBUF:
		return dequeue_buffer(fake, argument);
	case VIDIOC_STREAMON:
		return stream_on(fake);
	case VIDIOC_STREAMOFF:
		return stream_off(fake);
	default:
		return fail(ENOTTY);
	}
}
