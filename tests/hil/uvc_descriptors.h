/*
 * What the emulated USB camera says of itself: UVC 1.0, grey pixels, one bulk endpoint.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <linux/usb/ch9.h>

#define UVC_VIDEO_CONTROL 0 /* interfaces */
#define UVC_VIDEO_STREAMING 1
#define UVC_CAMERA_TERMINAL 1 /* entities */
#define UVC_PROCESSING_UNIT 2
#define UVC_INTERVALS_MAX 3
#define UVC_PROBE_BYTES 26

struct uvc_mode {
	uint16_t width_px, height_px;
	uint32_t intervals_100ns[UVC_INTERVALS_MAX]; /* the first is the default */
	uint8_t interval_count;
};

extern const struct usb_endpoint_descriptor uvc_endpoint;

/* Returns how many bytes of `out` the configuration takes; 512 are enough. */
size_t uvc_describe(const struct uvc_mode *mode, uint8_t *out);

/* The answer to a request for the probe or commit control. */
void uvc_fill_probe(const struct uvc_mode *mode, uint32_t interval_100ns,
		    uint8_t out[UVC_PROBE_BYTES]);
uint32_t uvc_probe_interval(const uint8_t probe[UVC_PROBE_BYTES]);

#define UVC_PAYLOAD_HEADER_BYTES 2
