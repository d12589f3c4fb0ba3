/*
 * stagectl camera noise: electrons per grey value and read noise of a camera, from images of
 * something that holds still.
 */
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/frame_feed.h"
#include "ctl/print_json.h"
#include "track/blobs/noise_meter.h"

#define FRAMES_DEFAULT 64
#define FRAMES_MIN 2

struct measuring {
	struct noise_meter meter;
	uint64_t wanted, taken;
	int width_px, height_px;
	uint8_t *before; /* the image before, owned */
	bool show_progress, failed;
};

static bool take_image(const struct fed_image *image, void *user)
{
	struct measuring *m = user;
	size_t row_bytes = (size_t)image->width_px;

	if (!m->before) {
		m->before = malloc(row_bytes * (size_t)image->height_px);
		m->width_px = image->width_px;
		m->height_px = image->height_px;
	}
	m->failed =
		!m->before || m->width_px != image->width_px || m->height_px != image->height_px;
	if (m->failed)
		return false;
	if (m->taken)
		noise_meter_add(&m->meter, image->pixels, m->before, m->width_px, m->height_px,
				image->stride_bytes, m->width_px);
	for (int y = 0; y < m->height_px; y++)
		memcpy(m->before + (size_t)y * row_bytes,
		       image->pixels + (ptrdiff_t)y * image->stride_bytes, row_bytes);
	m->taken++;
	if (m->show_progress)
		fprintf(stderr, "\r%" PRIu64 " of %" PRIu64 " images ", m->taken, m->wanted);
	return m->taken < m->wanted;
}

static void report(const char *camera, const struct measuring *m, const struct noise_model *model,
		   bool json)
{
	if (json) {
		json_t *object = json_pack(
			"{s:s, s:I, s:f, s:f, s:f, s:i, s:i, s:i}", "camera", camera, "images",
			(json_int_t)m->taken, "electrons_per_grey", model->electrons_per_grey,
			"electrons_per_grey_sigma", model->electrons_per_grey_sigma,
			"read_noise_grey", model->read_noise_grey, "dark_grey", model->dark_grey,
			"lowest_grey", model->lowest_grey, "highest_grey", model->highest_grey);

		print_json(object);
		return;
	}
	printf("%s: %" PRIu64 " images, light from %d to %d grey values\n"
	       "read noise %.2f grey values (the station finds it anew in every image)\n"
	       "%.1f +- %.1f electrons per grey value; in the config, under the camera:\n"
	       "  electrons_per_grey: %.1f\n",
	       camera, m->taken, model->lowest_grey, model->highest_grey, model->read_noise_grey,
	       model->electrons_per_grey, model->electrons_per_grey_sigma,
	       model->electrons_per_grey);
}

static int solve(const char *camera, const struct measuring *m, bool json)
{
	struct noise_model model;
	int err;

	if (m->failed || m->taken < FRAMES_MIN) {
		fprintf(stderr, "stagectl: camera %s: %s\n", camera,
			m->failed ? "its images change their size, or memory is short"
				  : "fewer than two images came");
		return EXIT_CODE_BAD_INPUT;
	}
	err = noise_meter_solve(&m->meter, &model);
	if (err == -ENODATA)
		fprintf(stderr,
			"stagectl: camera %s: fewer than %d grey values are in the images, and "
			"hold still: show it something from dark to bright that does not move, "
			"out of focus best, such as a sheet of paper lit from one side\n",
			camera, NOISE_SPAN_GREY);
	else if (err)
		fprintf(stderr,
			"stagectl: camera %s: the noise does not rise with the light: switch off "
			"gamma, sharpening and noise reduction in the camera, and take care that "
			"nothing moves\n",
			camera);
	if (err)
		return EXIT_CODE_BAD_INPUT;
	report(camera, m, &model, json);
	return EXIT_CODE_OK;
}

int verb_camera_noise(const struct verb *verb, int argc, char **argv)
{
	const char *camera, *socket_dir = DEFAULT_SOCKET_DIR;
	uint64_t frames = FRAMES_DEFAULT;
	bool json = false;
	const struct argument arguments[] = {
		{"frames", "N", "images to take (default 64)", .count = &frames},
		ARGUMENT_SOCKET_DIR(&socket_dir),
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &camera, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	if (frames < FRAMES_MIN) {
		fputs("stagectl: --frames: noise shows between images: ask for two at least\n",
		      stderr);
		return EXIT_CODE_USAGE;
	}
	struct measuring *m = calloc(1, sizeof(*m));
	if (!m)
		return EXIT_CODE_INTERNAL;
	m->wanted = frames;
	m->show_progress = isatty(STDERR_FILENO);
	int code = frame_feed(camera, socket_dir, take_image, m);
	if (m->show_progress)
		fputc('\n', stderr);
	if (code == EXIT_CODE_OK)
		code = solve(camera, m, json);
	free(m->before);
	free(m);
	return code;
}
