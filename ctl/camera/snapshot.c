/*
 * Snapshots from devices and from the station.
 */
#include "ctl/camera/snapshot.h"

#include <errno.h>
#include <jansson.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/camera/picture_plain.h"
#include "ctl/control_client.h"
#include "ctl/program_drivers.h"
#include "track/blobs/blobs.h"

#define FRAME_WAIT_NS (3 * NS_PER_S)

bool snapshot_is_address(const char *camera)
{
	return strchr(camera, ':') != NULL;
}

void snapshot_finish(struct snapshot *snapshot)
{
	free(snapshot->pixels);
	memset(snapshot, 0, sizeof(*snapshot));
}

static int find_blobs(struct snapshot *out)
{
	struct grey_image image = {out->pixels, out->width_px, out->height_px, out->width_px, 8};
	struct blob_settings settings = blob_settings_default();
	struct blob_finder *finder;
	int err = blob_finder_create(&finder, out->width_px, out->height_px, &settings);

	if (err)
		return err;
	struct blob_set *set = calloc(1, sizeof(*set));
	if (set) {
		blob_finder_run(finder, &image, set);
		out->blob_count = set->blob_count;
		memcpy(out->blobs, set->blobs, set->blob_count * sizeof(set->blobs[0]));
	}
	free(set);
	blob_finder_destroy(finder);
	return set ? 0 : -ENOMEM;
}

static int copy_frame(struct snapshot *out, const struct frame *frame)
{
	int err = picture_make_plain(frame, &out->pixels, &out->format);

	if (err)
		return err;
	out->width_px = frame->width_px;
	out->height_px = frame->height_px;
	out->mid_exposure_ns = frame->mid_exposure_ns;
	return out->format == PIXEL_GREY8 ? find_blobs(out) : 0;
}

int snapshot_from_frame(struct snapshot *out, const char *camera, const struct frame *frame)
{
	memset(out, 0, sizeof(*out));
	snprintf(out->camera, sizeof(out->camera), "%s", camera);
	return copy_frame(out, frame);
}

int snapshot_configure(const struct camera_driver *driver, struct camera *camera,
		       struct camera_mode *granted, struct diag *diag)
{
	static const struct camera_mode grey = {.format = PIXEL_GREY8},
					colour = {.format = PIXEL_BAYER_RG8};
	int err = driver->configure(camera, &grey, granted, NULL);

	return err ? driver->configure(camera, &colour, granted, diag) : 0;
}

static int grab(struct snapshot *out, const struct camera_driver *driver, struct camera *camera,
		struct diag *diag)
{
	struct camera_mode granted;
	int64_t give_up_ns = clock_now_ns() + FRAME_WAIT_NS;
	struct frame frame;
	int err = snapshot_configure(driver, camera, &granted, diag);

	if (!err)
		err = driver->start(camera, diag);
	if (err)
		return err;
	do {
		err = driver->acquire(camera, FRAME_WAIT_NS, &frame);
	} while (err == -EBADMSG && clock_now_ns() < give_up_ns);
	if (err)
		diag_add(diag, "%s: no image came: %s", out->camera, strerror(-err));
	else
		err = copy_frame(out, &frame);
	if (!err)
		driver->release(camera, &frame);
	driver->stop(camera);
	return err;
}

int snapshot_from_address(struct snapshot *out, const char *address)
{
	struct diag diag = {0};
	struct camera *camera = NULL;
	const char *rest;
	const struct camera_driver *driver =
		camera_driver_find(live_drivers, address, &rest, &diag);
	int code = driver ? EXIT_CODE_OK : EXIT_CODE_USAGE;

	memset(out, 0, sizeof(*out));
	snprintf(out->camera, sizeof(out->camera), "%s", address);
	if (driver) {
		int err = driver->open(&camera, rest, NULL, &diag);

		if (!err) {
			err = grab(out, driver, camera, &diag);
			driver->close(camera);
		}
		code = exit_code_of(err, EXIT_CODE_DEVICE);
	}
	diag_print(&diag, stderr);
	diag_finish(&diag);
	if (code)
		snapshot_finish(out);
	return code;
}

static int base64_digit(char c)
{
	static const char digits[] =
		"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	const char *found = c ? strchr(digits, c) : NULL;

	return found ? (int)(found - digits) : 0;
}

/* What base64 of so many characters holds. */
static size_t decoded_bytes(const char *text, size_t length)
{
	size_t padding = length > 1 ? (text[length - 1] == '=') + (text[length - 2] == '=') : 0;

	return length / 4 * 3 - padding;
}

/* NULL without memory. */
static uint8_t *decode_base64(const char *text, size_t size)
{
	uint8_t *bytes = malloc(size + 1);
	size_t used = 0;

	for (const char *t = text; bytes && used < size; t += 4) {
		uint32_t three = (uint32_t)(base64_digit(t[0]) << 18 | base64_digit(t[1]) << 12 |
					    base64_digit(t[2]) << 6 | base64_digit(t[3]));

		for (int shift = 16; shift >= 0 && used < size; shift -= 8)
			bytes[used++] = (uint8_t)(three >> shift);
	}
	return bytes;
}

/* `sent` says how the pixels are to be read. */
static int decode_pixels(struct snapshot *out, const char *text, struct frame *sent)
{
	size_t length = strlen(text), size = decoded_bytes(text, length);
	size_t row_bytes = pixel_row_bytes(sent->format, sent->width_px);

	if (length % 4 ||
	    (sent->format != PIXEL_MJPEG && size != row_bytes * (size_t)sent->height_px))
		return -EPROTO;
	uint8_t *bytes = decode_base64(text, size);

	if (!bytes)
		return -ENOMEM;
	sent->pixels = bytes;
	sent->size_bytes = size;
	sent->stride_bytes = (int)row_bytes;
	int err = picture_make_plain(sent, &out->pixels, &out->format);

	free(bytes);
	return err;
}

static void unpack_blobs(struct snapshot *out, const json_t *blobs)
{
	for (size_t b = 0; b < json_array_size(blobs) && b < BLOB_MAX; b++) {
		double x_px = 0, y_px = 0, sigma_px = 0, area_px2 = 0;

		json_unpack(json_array_get(blobs, b), "{s:F, s:F, s:F, s:F}", "x_px", &x_px, "y_px",
			    &y_px, "sigma_px", &sigma_px, "area_px2", &area_px2);
		out->blobs[out->blob_count++] = (struct blob){.x_px = (float)x_px,
							      .y_px = (float)y_px,
							      .sigma_px = (float)sigma_px,
							      .area_px2 = (float)area_px2};
	}
}

static int unpack_snapshot(struct snapshot *out, json_t *reply)
{
	const char *pixels, *format;
	json_int_t mid_exposure_ns;
	struct frame sent = {0};

	if (json_unpack(reply, "{s:i, s:i, s:s, s:s, s:I, s?i}", "width_px", &out->width_px,
			"height_px", &out->height_px, "format", &format, "pixels", &pixels,
			"mid_exposure_ns", &mid_exposure_ns, "bits", &sent.bits) < 0 ||
	    out->width_px <= 0 || out->width_px > 65535 || out->height_px <= 0 ||
	    out->height_px > 65535 || pixel_format_by_name(&sent.format, format))
		return -EPROTO;
	out->mid_exposure_ns = mid_exposure_ns;
	unpack_blobs(out, json_object_get(reply, "blobs"));
	sent.width_px = out->width_px;
	sent.height_px = out->height_px;
	return decode_pixels(out, pixels, &sent);
}

int snapshot_from_station(struct snapshot *out, const char *socket_dir, const char *name)
{
	json_t *reply;
	int code = control_ask(&reply, socket_dir, "org.stage.Control.Preview",
			       json_pack("{s:s}", "camera", name));

	if (code)
		return code;
	memset(out, 0, sizeof(*out));
	snprintf(out->camera, sizeof(out->camera), "%s", name);
	int err = unpack_snapshot(out, reply);
	json_decref(reply);
	if (!err)
		return EXIT_CODE_OK;
	fprintf(stderr, "stagectl: camera %s: what the station sent is no image\n", name);
	snapshot_finish(out);
	return EXIT_CODE_CONNECTION;
}
