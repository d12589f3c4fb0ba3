/*
 * The station copies one image at a time for whoever asks; a device gives them all.
 */
#include "ctl/frame_feed.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/camera/snapshot.h"
#include "ctl/program_drivers.h"

#define FRAME_WAIT_NS (3 * NS_PER_S)

static int refuse_colour(const char *camera)
{
	fprintf(stderr, "stagectl: camera %s takes colour images: ask for one with the role ir\n",
		camera);
	return EXIT_CODE_USAGE;
}

static int refuse_words(const char *address)
{
	fprintf(stderr,
		"stagectl: %s gives pixels of 16 bits alone: ask for the camera by its name while "
		"the station runs, which hands out 8 of them\n",
		address);
	return EXIT_CODE_USAGE;
}

static int feed_from_station(const char *name, const char *socket_dir, frame_feed_fn *take,
			     void *user)
{
	struct snapshot *snapshot = calloc(1, sizeof(*snapshot));
	bool more = true;
	int code = snapshot ? EXIT_CODE_OK : EXIT_CODE_INTERNAL;

	while (!code && more) {
		code = snapshot_from_station(snapshot, socket_dir, name);
		if (code)
			break;
		if (snapshot->format == PIXEL_GREY8) {
			struct fed_image image = {snapshot->pixels, snapshot->width_px,
						  snapshot->height_px, snapshot->width_px};

			more = take(&image, user);
		} else {
			code = refuse_colour(name);
		}
		snapshot_finish(snapshot);
	}
	free(snapshot);
	return code;
}

/* Until `take` has enough: 0; a recording's end is no error either. */
static int feed_running(const char *address, struct camera *camera, frame_feed_fn *take, void *user,
			struct diag *diag)
{
	int64_t give_up_ns = clock_now_ns() + FRAME_WAIT_NS;
	struct frame frame;
	bool more = true;

	while (more) {
		int err = camera->driver->acquire(camera, FRAME_WAIT_NS, &frame);

		if (err == -ENODATA)
			return 0;
		if (err == -EBADMSG && clock_now_ns() < give_up_ns)
			continue;
		if (err) {
			diag_add(diag, "%s: no image came: %s", address, strerror(-err));
			return err;
		}
		struct fed_image image = {frame.pixels, frame.width_px, frame.height_px,
					  frame.stride_bytes};
		give_up_ns = clock_now_ns() + FRAME_WAIT_NS;
		more = take(&image, user);
		camera->driver->release(camera, &frame);
	}
	return 0;
}

static int feed_camera(const char *address, struct camera *camera, frame_feed_fn *take, void *user,
		       struct diag *diag)
{
	struct camera_mode wanted = {.format = PIXEL_GREY8}, granted;
	int err = camera->driver->configure(camera, &wanted, &granted, diag);

	if (!err && granted.format == PIXEL_GREY16)
		return refuse_words(address);
	if (!err && granted.format != PIXEL_GREY8)
		return refuse_colour(address);
	if (!err)
		err = camera->driver->start(camera, diag);
	if (err)
		return exit_code_of(err, EXIT_CODE_DEVICE);
	err = feed_running(address, camera, take, user, diag);
	camera->driver->stop(camera);
	return exit_code_of(err, EXIT_CODE_DEVICE);
}

static int feed_from_address(const char *address, frame_feed_fn *take, void *user)
{
	struct diag diag = {0};
	struct camera *camera = NULL;
	const char *rest;
	const struct camera_driver *driver =
		camera_driver_find(live_drivers, address, &rest, &diag);
	int code = EXIT_CODE_USAGE;

	if (driver) {
		int err = driver->open(&camera, rest, NULL, &diag);

		code = err ? (int)exit_code_of(err, EXIT_CODE_DEVICE)
			   : feed_camera(address, camera, take, user, &diag);
		if (!err)
			driver->close(camera);
	}
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return code;
}

int frame_feed(const char *camera, const char *socket_dir, frame_feed_fn *take, void *user)
{
	return snapshot_is_address(camera) ? feed_from_address(camera, take, user)
					   : feed_from_station(camera, socket_dir, take, user);
}
