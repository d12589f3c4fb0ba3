/*
 * The configuration of the emulated USB camera. One payload holds a whole frame.
 */
#include "tests/hil/uvc_descriptors.h"

#include <string.h>

#include <linux/usb/video.h>

#define LE16(value) (uint8_t)(value), (uint8_t)((value) >> 8)
#define LE32(value) LE16(value), LE16((value) >> 16)
#define CS_INTERFACE 0x24
#define ENDPOINT_ADDRESS 0x81
#define ENDPOINT_PACKET_BYTES 512

const struct usb_endpoint_descriptor uvc_endpoint = {
	.bLength = USB_DT_ENDPOINT_SIZE,
	.bDescriptorType = USB_DT_ENDPOINT,
	.bEndpointAddress = ENDPOINT_ADDRESS,
	.bmAttributes = USB_ENDPOINT_XFER_BULK,
	.wMaxPacketSize = ENDPOINT_PACKET_BYTES,
};

static size_t append(uint8_t *out, size_t at, const void *data, size_t bytes)
{
	memcpy(out + at, data, bytes);
	return at + bytes;
}

static size_t append_control_interface(uint8_t *out, size_t at)
{
	static const uint8_t descriptors[] = {
		/* association of the two interfaces */
		8, USB_DT_INTERFACE_ASSOCIATION, UVC_VIDEO_CONTROL, 2, USB_CLASS_VIDEO,
		UVC_SC_VIDEO_INTERFACE_COLLECTION, 0, 0,
		/* interface without endpoints */
		9, USB_DT_INTERFACE, UVC_VIDEO_CONTROL, 0, 0, USB_CLASS_VIDEO, UVC_SC_VIDEOCONTROL,
		0, 0,
		/* header: version, bytes of the class-specific part, clock, streaming interfaces */
		13, CS_INTERFACE, UVC_VC_HEADER, LE16(0x0100), LE16(13 + 17 + 11 + 9),
		LE32(1000000), 1, UVC_VIDEO_STREAMING,
		/* camera: exposure mode and exposure time can be set */
		17, CS_INTERFACE, UVC_VC_INPUT_TERMINAL, UVC_CAMERA_TERMINAL, LE16(UVC_ITT_CAMERA),
		0, 0, LE16(0), LE16(0), LE16(0), 2, LE16(0x000a),
		/* processing: gain can be set */
		11, CS_INTERFACE, UVC_VC_PROCESSING_UNIT, UVC_PROCESSING_UNIT, UVC_CAMERA_TERMINAL,
		LE16(0), 2, LE16(0x0200), 0,
		/* to the stream */
		9, CS_INTERFACE, UVC_VC_OUTPUT_TERMINAL, 3, LE16(UVC_TT_STREAMING), 0,
		UVC_PROCESSING_UNIT, 0};

	return append(out, at, descriptors, sizeof(descriptors));
}

static size_t append_streaming_interface(const struct uvc_mode *mode, uint8_t *out, size_t at)
{
	const uint8_t frame_bytes = (uint8_t)(26 + 4 * mode->interval_count);
	const uint32_t image_bytes = (uint32_t)mode->width_px * mode->height_px;
	const uint8_t descriptors[] = {
		/* interface with the endpoint */
		9, USB_DT_INTERFACE, UVC_VIDEO_STREAMING, 0, 1, USB_CLASS_VIDEO,
		UVC_SC_VIDEOSTREAMING, 0, 0,
		/* header: one format */
		14, CS_INTERFACE, UVC_VS_INPUT_HEADER, 1, LE16(14 + 27 + frame_bytes),
		ENDPOINT_ADDRESS, 0, 3, 0, 0, 0, 1, 0,
		/* 8-bit grey: the GUID of Y800 */
		27, CS_INTERFACE, UVC_VS_FORMAT_UNCOMPRESSED, 1, 1, 'Y', '8', '0', '0', 0, 0, 0x10,
		0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71, 8, 1, 0, 0, 0, 0,
		/* one size */
		frame_bytes, CS_INTERFACE, UVC_VS_FRAME_UNCOMPRESSED, 1, 0, LE16(mode->width_px),
		LE16(mode->height_px), LE32(image_bytes * 8), LE32(image_bytes * 8 * 30),
		LE32(image_bytes), LE32(mode->intervals_100ns[0]), mode->interval_count};

	at = append(out, at, descriptors, sizeof(descriptors));
	for (int i = 0; i < mode->interval_count; i++) {
		const uint8_t interval[] = {LE32(mode->intervals_100ns[i])};

		at = append(out, at, interval, sizeof(interval));
	}
	return append(out, at, &uvc_endpoint, USB_DT_ENDPOINT_SIZE);
}

size_t uvc_describe(const struct uvc_mode *mode, uint8_t *out)
{
	size_t at = USB_DT_CONFIG_SIZE;

	at = append_control_interface(out, at);
	at = append_streaming_interface(mode, out, at);
	const uint8_t configuration[USB_DT_CONFIG_SIZE] = {
		USB_DT_CONFIG_SIZE, USB_DT_CONFIG, LE16(at), 2, 1, 0, USB_CONFIG_ATT_ONE, 50};

	append(out, 0, configuration, sizeof(configuration));
	return at;
}

void uvc_fill_probe(const struct uvc_mode *mode, uint32_t interval_100ns,
		    uint8_t out[UVC_PROBE_BYTES])
{
	const uint32_t image_bytes = (uint32_t)mode->width_px * mode->height_px;
	const uint8_t probe[UVC_PROBE_BYTES] = {LE16(1), /* the interval is to be kept */
						1,
						1,
						LE32(interval_100ns),
						LE16(0),
						LE16(0),
						LE16(0),
						LE16(0),
						LE16(0),
						LE32(image_bytes),
						LE32(image_bytes + UVC_PAYLOAD_HEADER_BYTES)};

	memcpy(out, probe, sizeof(probe));
}

uint32_t uvc_probe_interval(const uint8_t probe[UVC_PROBE_BYTES])
{
	return probe[4] | (uint32_t)probe[5] << 8 | (uint32_t)probe[6] << 16 |
	       (uint32_t)probe[7] << 24;
}
