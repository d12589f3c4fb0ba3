/*
 * The controls of the emulated USB camera.
 */
#include "tests/hil/uvc_controls.h"

#include <stdatomic.h>
#include <stddef.h>

#include <linux/usb/video.h>

#include "base/clock.h"
#include "tests/hil/usb_device.h"
#include "tests/hil/uvc_descriptors.h"

#define EXPOSURE_TIME 1 /* in controls */
#define EXPOSURE_UNIT_NS (100 * NS_PER_US)

/* A control that keeps what it is told. */
static struct control {
	uint8_t entity, selector, bytes;
	uint32_t minimum, maximum, step;
	_Atomic uint32_t value;
} controls[] = {
	{UVC_CAMERA_TERMINAL, UVC_CT_AE_MODE_CONTROL, 1, 1, 8, 9, 8},
	[EXPOSURE_TIME] = {UVC_CAMERA_TERMINAL, UVC_CT_EXPOSURE_TIME_ABSOLUTE_CONTROL, 4, 1, 3333,
			   1, 100},
	{UVC_PROCESSING_UNIT, UVC_PU_GAIN_CONTROL, 2, 0, 480, 1, 0},
};

static struct control *find_control(const struct usb_ctrlrequest *request)
{
	for (size_t i = 0; i < sizeof(controls) / sizeof(controls[0]); i++)
		if (controls[i].entity == request->wIndex >> 8 &&
		    controls[i].selector == request->wValue >> 8)
			return &controls[i];
	return NULL;
}

int uvc_reply_number(int fd, const struct usb_ctrlrequest *request, uint32_t value, size_t bytes)
{
	const uint8_t reply[] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16),
				 (uint8_t)(value >> 24)};

	return usb_device_reply(fd, request, reply, bytes);
}

static int set_control(int fd, const struct usb_ctrlrequest *request, struct control *control)
{
	uint8_t in[4] = {0};
	int err = usb_device_receive(fd, request, in, control->bytes);

	if (!err)
		control->value = in[0] | (uint32_t)in[1] << 8 | (uint32_t)in[2] << 16 |
				 (uint32_t)in[3] << 24;
	return err;
}

int uvc_answer_control(int fd, const struct usb_ctrlrequest *request)
{
	struct control *control = find_control(request);

	if (!control)
		return usb_device_refuse(fd);
	switch (request->bRequest) {
	case UVC_SET_CUR:
		return set_control(fd, request, control);
	case UVC_GET_CUR:
	case UVC_GET_DEF:
		return uvc_reply_number(fd, request, control->value, control->bytes);
	case UVC_GET_MIN:
		return uvc_reply_number(fd, request, control->minimum, control->bytes);
	case UVC_GET_MAX:
		return uvc_reply_number(fd, request, control->maximum, control->bytes);
	case UVC_GET_RES:
		return uvc_reply_number(fd, request, control->step, control->bytes);
	case UVC_GET_INFO:
		return uvc_reply_number(fd, request, UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_SET, 1);
	case UVC_GET_LEN:
		return uvc_reply_number(fd, request, control->bytes, 2);
	default:
		return usb_device_refuse(fd);
	}
}

int64_t uvc_exposure_ns(void)
{
	return controls[EXPOSURE_TIME].value * EXPOSURE_UNIT_NS;
}
