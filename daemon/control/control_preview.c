/*
 * Images over the control socket: asks a camera for its next frame, and packs it when it is there.
 */
#include <stdlib.h>
#include <string.h>

#include "daemon/control/control_methods.h"

static json_t *no_such_camera(const struct station *station, const char *name)
{
	json_t *known = json_array();

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		json_array_append_new(known, json_string(station->captures[c].name));
	return varlink_error("org.stage.Control.NoSuchCamera",
			     json_pack("{s:s, s:o}", "camera", name, "cameras", known));
}

struct capture *named_camera(const struct call *call, json_t **refusal)
{
	const char *name = json_string_value(json_object_get(call->parameters, "camera"));
	struct station *station = call->context->station;

	for (uint32_t c = 0; name && c < station->stage.config.camera_count; c++)
		if (strcmp(station->captures[c].name, name) == 0)
			return &station->captures[c];
	*refusal = name ? no_such_camera(station, name) : varlink_invalid_parameter("camera");
	return NULL;
}

static json_t *no_frame(const struct capture *capture)
{
	return varlink_error("org.stage.Control.NoFrame",
			     json_pack("{s:s, s:s}", "camera", capture->name, "state",
				       capture_state_name(atomic_load(&capture->state))));
}

json_t *control_preview(struct call *call)
{
	json_t *refusal;
	struct capture *capture = named_camera(call, &refusal);

	if (!capture)
		return refusal;
	if (atomic_load(&capture->state) != CAPTURE_RUNNING)
		return no_frame(capture);
	capture_request_preview(capture);
	*call->wait = (struct wait){.kind = WAIT_PREVIEW,
				    .camera = (int)(capture - call->context->station->captures)};
	return NULL;
}

static size_t base64_length(size_t size_bytes)
{
	return (size_bytes + 2) / 3 * 4;
}

static void base64_write(char *out, const uint8_t *bytes, size_t size_bytes)
{
	static const char digits[] =
		"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

	for (size_t i = 0; i < size_bytes; i += 3) {
		size_t left = size_bytes - i;
		uint32_t three = (uint32_t)bytes[i] << 16 |
				 (left > 1 ? (uint32_t)bytes[i + 1] << 8 : 0) |
				 (left > 2 ? bytes[i + 2] : 0u);

		*out++ = digits[three >> 18];
		*out++ = digits[three >> 12 & 63];
		*out++ = left > 1 ? digits[three >> 6 & 63] : '=';
		*out++ = left > 2 ? digits[three & 63] : '=';
	}
}

static json_t *blobs_json(const struct blob_set *set)
{
	json_t *blobs = json_array();

	for (uint32_t b = 0; b < set->blob_count; b++) {
		const struct blob *blob = &set->blobs[b];

		json_array_append_new(blobs,
				      json_pack("{s:f, s:f, s:f, s:f, s:i, s:b, s:b, s:b}", "x_px",
						(double)blob->x_px, "y_px", (double)blob->y_px,
						"sigma_px", (double)blob->sigma_px, "area_px2",
						(double)blob->area_px2, "peak", (int)blob->peak,
						"saturated", (blob->flags & BLOB_SATURATED) != 0,
						"merged", (blob->flags & BLOB_MERGED) != 0, "edge",
						(blob->flags & BLOB_EDGE) != 0));
	}
	return blobs;
}

/* An image's place in memory; what is to say of it besides is in a reply. */
struct image_bytes {
	const uint8_t *bytes;
	size_t size_bytes;
};

#define NO_PIXELS "\"pixels\":\"\""

/* The reply as text, with the image put into its empty `pixels`: a JSON library would look at every
 * one of millions of characters while the stream waits. Takes the reply over. NULL without memory.
 */
static char *text_with_pixels(json_t *reply, struct image_bytes image)
{
	char *text = json_dumps(reply, JSON_COMPACT);
	char *at = text ? strstr(text, NO_PIXELS) : NULL;
	size_t length = base64_length(image.size_bytes);

	json_decref(reply);
	if (!at)
		return text;
	at += strlen(NO_PIXELS) - 1; /* before the closing quote */
	size_t head = (size_t)(at - text), tail = strlen(at) + 1;
	char *whole = malloc(head + length + tail);
	if (whole) {
		memcpy(whole, text, head);
		base64_write(whole + head, image.bytes, image.size_bytes);
		memcpy(whole + head + length, at, tail);
	}
	free(text);
	return whole;
}

static json_t *image_json(const char *camera, int width_px, int height_px, enum pixel_format format,
			  int64_t mid_exposure_ns, json_t *blobs)
{
	return json_pack("{s:s, s:i, s:i, s:s, s:I, s:s, s:o}", "camera", camera, "width_px",
			 width_px, "height_px", height_px, "format", pixel_format_name(format),
			 "mid_exposure_ns", (json_int_t)mid_exposure_ns, "pixels", "", "blobs",
			 blobs);
}

static char *ir_reply(const struct capture *capture)
{
	const struct preview *image = &capture->preview;
	json_t *json = image_json(capture->name, image->width_px, image->height_px, image->format,
				  image->set.mid_exposure_ns, blobs_json(&image->set));

	if (image->format == PIXEL_GREY16)
		json_object_set_new(json, "bits", json_integer(capture->device.granted.bits));
	return text_with_pixels(varlink_result(json),
				(struct image_bytes){image->pixels, image->size_bytes});
}

/* Of the newest frame in the pool; NULL in the rare case that it was overwritten just now. */
static char *hd_reply(struct capture *capture)
{
	struct hd_pool *pool = &capture->hd.pool;
	const struct hd_frame *frame = hd_pool_hold(pool, hd_pool_newest(pool));

	if (!frame)
		return NULL;
	json_t *json = image_json(capture->name, frame->width_px, frame->height_px, frame->format,
				  frame->mid_exposure_ns, json_array());
	uint64_t shot = atomic_load(&frame->shot);

	if (shot != SHOT_UNKNOWN)
		json_object_set_new(json, "shot", json_integer((json_int_t)shot));
	char *text = text_with_pixels(varlink_result(json),
				      (struct image_bytes){frame->pixels, frame->size_bytes});
	hd_pool_release(frame);
	return text;
}

char *preview_reply(struct station *station, int camera, bool ready)
{
	struct capture *capture = &station->captures[camera];
	char *text = NULL;

	if (ready)
		text = capture->role == ROLE_IR ? ir_reply(capture) : hd_reply(capture);
	return text ? text : text_with_pixels(no_frame(capture), (struct image_bytes){NULL, 0});
}
