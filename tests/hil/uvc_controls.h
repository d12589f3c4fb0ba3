/*
 * The controls of the emulated USB camera: exposure mode, exposure time and gain. They keep what
 * they are told. Control thread, unless said otherwise.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <linux/usb/ch9.h>

/* Answers a request to a control; one that there is not is refused. Returns 0 or a negative errno.
 */
int uvc_answer_control(int fd, const struct usb_ctrlrequest *request);

int64_t uvc_exposure_ns(void); /* any thread */

int uvc_reply_number(int fd, const struct usb_ctrlrequest *request, uint32_t value, size_t bytes);
