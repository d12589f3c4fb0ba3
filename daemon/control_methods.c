/*
 * org.varlink.service and org.stage.Control.
 */
#include "daemon/control_methods.h"

#include <stdlib.h>
#include <string.h>

static const char service_interface[] =
	"interface org.varlink.service\n\n"
	"method GetInfo() -> (vendor: string, product: string, version: string, url: string, "
	"interfaces: []string)\n"
	"method GetInterfaceDescription(interface: string) -> (description: string)\n\n"
	"error InterfaceNotFound (interface: string)\n"
	"error MethodNotFound (method: string)\n"
	"error MethodNotImplemented (method: string)\n"
	"error InvalidParameter (parameter: string)\n";

static const char control_interface[] =
	"# A motion-capture station\n"
	"interface org.stage.Control\n\n"
	"# State, cameras, losses by cause, latencies, subscribers\n"
	"method GetStatus() -> (status: object)\n\n"
	"# The next frame of a camera: rows of grey, rgb or bayer_rg bytes in base64, and the "
	"spots "
	"found in it\n"
	"method Preview(camera: string) -> (camera: string, width_px: int, height_px: int, "
	"format: string, mid_exposure_ns: int, pixels: string, blobs: []object, shot: ?int)\n\n"
	"error NoSuchCamera (camera: string, cameras: []string)\n"
	"error NoFrame (camera: string, state: string)\n";

static json_t *reply_error(const char *error, const char *name, const char *value)
{
	return json_pack("{s:s, s:{s:s}}", "error", error, "parameters", name, value);
}

static json_t *reply_result(json_t *parameters)
{
	return json_pack("{s:o}", "parameters", parameters);
}

static json_t *get_info(void)
{
	return reply_result(json_pack("{s:s, s:s, s:s, s:s, s:[s,s]}", "vendor", "stage", "product",
				      "staged", "version", STAGE_VERSION, "url", "", "interfaces",
				      "org.varlink.service", "org.stage.Control"));
}

static json_t *get_interface_description(const json_t *parameters)
{
	const char *name = json_string_value(json_object_get(parameters, "interface"));
	const char *text = NULL;

	if (!name)
		return reply_error("org.varlink.service.InvalidParameter", "parameter",
				   "interface");
	if (strcmp(name, "org.varlink.service") == 0)
		text = service_interface;
	else if (strcmp(name, "org.stage.Control") == 0)
		text = control_interface;
	if (!text)
		return reply_error("org.varlink.service.InterfaceNotFound", "interface", name);
	return reply_result(json_pack("{s:s}", "description", text));
}

static json_t *no_such_camera(const struct station *station, const char *name)
{
	json_t *known = json_array();

	for (uint32_t c = 0; c < station->stage.config.camera_count; c++)
		json_array_append_new(known, json_string(station->captures[c].name));
	return json_pack("{s:s, s:{s:s, s:o}}", "error", "org.stage.Control.NoSuchCamera",
			 "parameters", "camera", name, "cameras", known);
}

static json_t *preview(struct station *station, const json_t *parameters, int *preview_camera)
{
	const char *name = json_string_value(json_object_get(parameters, "camera"));

	if (!name)
		return reply_error("org.varlink.service.InvalidParameter", "parameter", "camera");
	for (uint32_t c = 0; c < station->stage.config.camera_count; c++) {
		struct capture *capture = &station->captures[c];

		if (strcmp(capture->name, name) != 0)
			continue;
		if (atomic_load(&capture->state) != CAPTURE_RUNNING)
			return preview_reply(station, (int)c, false);
		capture_request_preview(capture);
		*preview_camera = (int)c;
		return NULL;
	}
	return no_such_camera(station, name);
}

json_t *control_call(const struct control_context *context, const json_t *request,
		     int *preview_camera)
{
	const char *method = json_string_value(json_object_get(request, "method"));
	const json_t *parameters = json_object_get(request, "parameters");

	if (strcmp(method, "org.stage.Control.GetStatus") == 0)
		return reply_result(json_pack("{s:o}", "status", station_status_json(context)));
	if (strcmp(method, "org.stage.Control.Preview") == 0)
		return preview(context->station, parameters, preview_camera);
	if (strcmp(method, "org.varlink.service.GetInfo") == 0)
		return get_info();
	if (strcmp(method, "org.varlink.service.GetInterfaceDescription") == 0)
		return get_interface_description(parameters);
	return reply_error("org.varlink.service.MethodNotFound", "method", method);
}

static char *base64(const uint8_t *bytes, size_t size_bytes)
{
	static const char digits[] =
		"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	char *text = malloc((size_bytes + 2) / 3 * 4 + 1);
	char *out = text;

	for (size_t i = 0; text && i < size_bytes; i += 3) {
		size_t left = size_bytes - i;
		uint32_t three = (uint32_t)bytes[i] << 16 |
				 (left > 1 ? (uint32_t)bytes[i + 1] << 8 : 0) |
				 (left > 2 ? bytes[i + 2] : 0u);

		*out++ = digits[three >> 18];
		*out++ = digits[three >> 12 & 63];
		*out++ = left > 1 ? digits[three >> 6 & 63] : '=';
		*out++ = left > 2 ? digits[three & 63] : '=';
	}
	if (text)
		*out = '\0';
	return text;
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

static json_t *image_json(const char *camera, const uint8_t *bytes, size_t size_bytes, int width_px,
			  int height_px, enum pixel_format format, int64_t mid_exposure_ns,
			  json_t *blobs)
{
	static const char *const formats[] = {
		[PIXEL_GREY8] = "grey", [PIXEL_RGB8] = "rgb", [PIXEL_BAYER_RG8] = "bayer_rg"};
	char *pixels = base64(bytes, size_bytes);
	json_t *image = json_pack("{s:s, s:i, s:i, s:s, s:I, s:s, s:o}", "camera", camera,
				  "width_px", width_px, "height_px", height_px, "format",
				  formats[format], "mid_exposure_ns", (json_int_t)mid_exposure_ns,
				  "pixels", pixels ? pixels : "", "blobs", blobs);

	free(pixels);
	return image;
}

static json_t *ir_image_json(const struct capture *capture)
{
	const struct preview *image = &capture->preview;

	return image_json(capture->name, image->pixels, image->size_bytes, image->width_px,
			  image->height_px, image->format, image->set.mid_exposure_ns,
			  blobs_json(&image->set));
}

/* The newest frame in the pool; NULL in the rare case that it was overwritten just now. */
static json_t *hd_image_json(struct capture *capture)
{
	struct hd_pool *pool = &capture->hd.pool;
	const struct hd_frame *frame = hd_pool_hold(pool, hd_pool_newest(pool));

	if (!frame)
		return NULL;
	json_t *image =
		image_json(capture->name, frame->pixels, frame->size_bytes, frame->width_px,
			   frame->height_px, frame->format, frame->mid_exposure_ns, json_array());
	uint64_t shot = atomic_load(&frame->shot);

	if (shot != SHOT_UNKNOWN)
		json_object_set_new(image, "shot", json_integer((json_int_t)shot));
	hd_pool_release(frame);
	return image;
}

json_t *preview_reply(struct station *station, int camera, bool ready)
{
	struct capture *capture = &station->captures[camera];
	json_t *image = NULL;

	if (ready)
		image = capture->role == ROLE_IR ? ir_image_json(capture) : hd_image_json(capture);
	if (image)
		return reply_result(image);
	return json_pack("{s:s, s:{s:s, s:s}}", "error", "org.stage.Control.NoFrame", "parameters",
			 "camera", capture->name, "state",
			 capture_state_name(atomic_load(&capture->state)));
}
