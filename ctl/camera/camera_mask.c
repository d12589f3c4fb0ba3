/*
 * stagectl camera mask: the areas of a camera's image in which spots do not count. Shown, found on
 * an empty stage, or cleared; the station takes a new mask at once, a file keeps it.
 */
#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "base/output_file.h"
#include "config/masks.h"
#include "ctl/arguments.h"
#include "ctl/camera/camera_status.h"
#include "ctl/camera/snapshot.h"
#include "ctl/control_client.h"
#include "ctl/frame_feed.h"
#include "ctl/print_json.h"
#include "protocol/mask_json.h"
#include "track/blobs/blobs.h"
#include "track/blobs/mask_find.h"

#define SECONDS_DEFAULT 3
#define FRAMES_MIN 5
#define FRAMES_MAX 1000

struct wish {
	const char *camera, *socket_dir, *save;
	bool find, clear, json;
	double seconds;
};

struct looking {
	struct mask_finder finder;
	struct blob_finder *blobs;
	struct blob_set set;
	int width_px, height_px;
	int64_t end_ns;
	bool failed, show_progress;
};

/* Lamps of any size; hot pixels are none of a mask's business. */
static int look_with(struct looking *looking, const struct fed_image *image)
{
	struct blob_settings settings = blob_settings_default();

	settings.area_max_px = image->width_px * image->height_px;
	looking->width_px = image->width_px;
	looking->height_px = image->height_px;
	return blob_finder_create(&looking->blobs, image->width_px, image->height_px, &settings);
}

static bool take_image(const struct fed_image *image, void *user)
{
	struct looking *looking = user;
	struct grey_image grey = {image->pixels, image->width_px, image->height_px,
				  image->stride_bytes, 8};

	looking->failed = (!looking->blobs && look_with(looking, image) < 0) ||
			  image->width_px != looking->width_px ||
			  image->height_px != looking->height_px;
	if (looking->failed)
		return false;
	blob_finder_run(looking->blobs, &grey, &looking->set);
	mask_finder_add(&looking->finder, &looking->set);
	if (looking->show_progress)
		fprintf(stderr, "\r%u images ", looking->finder.set_count);
	return looking->finder.set_count < FRAMES_MIN ||
	       (clock_now_ns() < looking->end_ns && looking->finder.set_count < FRAMES_MAX);
}

static int conclude(const struct wish *wish, const struct looking *looking, struct mask *mask)
{
	struct mask_finding finding;

	if (looking->failed || looking->finder.set_count < FRAMES_MIN) {
		fprintf(stderr, "stagectl: camera %s: %s\n", wish->camera,
			looking->failed ? "its images change their size, or memory is short"
					: "fewer than five images came: too few to tell what is "
					  "steady");
		return EXIT_CODE_BAD_INPUT;
	}
	finding = mask_finder_result(&looking->finder, looking->width_px, looking->height_px, mask);
	fprintf(stderr, "%u images, %u steady bright places in %u areas\n",
		looking->finder.set_count, finding.steady_count, mask->area_count);
	if (finding.unsteady_per_set >= 0.5)
		fprintf(stderr,
			"stagectl: camera %s: %.1f spots an image moved or flickered and are not "
			"masked; nobody and no marker may be on the stage meanwhile\n",
			wish->camera, finding.unsteady_per_set);
	return EXIT_CODE_OK;
}

static int find_mask(const struct wish *wish, struct mask *mask)
{
	struct looking *looking = calloc(1, sizeof(*looking));
	int code;

	if (!looking)
		return EXIT_CODE_INTERNAL;
	looking->end_ns = clock_now_ns() + (int64_t)(wish->seconds * NS_PER_S);
	looking->show_progress = isatty(STDERR_FILENO);
	code = frame_feed(wish->camera, wish->socket_dir, take_image, looking);
	if (looking->show_progress)
		fputc('\n', stderr);
	if (code == EXIT_CODE_OK)
		code = conclude(wish, looking, mask);
	blob_finder_destroy(looking->blobs);
	free(looking);
	return code;
}

static int set_mask(const struct wish *wish, const struct mask *mask)
{
	json_t *reply;
	int code = control_ask(
		&reply, wish->socket_dir, "org.stage.Control.SetMask",
		json_pack("{s:s, s:o}", "camera", wish->camera, "areas", mask_to_json(mask)));

	if (code == EXIT_CODE_OK)
		json_decref(reply);
	return code;
}

static int get_mask(const struct wish *wish, struct mask *mask)
{
	json_t *camera;
	int code = camera_status(&camera, wish->socket_dir, wish->camera);

	if (code)
		return code;
	if (!mask_from_json(mask, json_object_get(camera, "mask"))) {
		fprintf(stderr, "stagectl: camera %s: what answers tells no mask: no station\n",
			wish->camera);
		code = EXIT_CODE_CONNECTION;
	}
	json_decref(camera);
	return code;
}

/* Into the file that the config's `masks` names; other cameras' masks stay. */
static int save(const struct wish *wish, const struct mask *mask)
{
	struct diag diag = {0};
	struct output_file file;
	struct masks masks;
	int err = masks_load(&masks, wish->save, &diag);

	if (!err)
		err = masks_set(&masks, wish->camera, mask);
	if (err == -ENOSPC)
		diag_add(&diag, "%s: more than %d cameras", wish->save, CAMERA_MAX);
	int code = exit_code_of(err, EXIT_CODE_BAD_INPUT);
	if (!err) {
		err = output_file_open(&file, wish->save, &diag);
		if (!err) {
			masks_write(&masks, file.stream);
			err = output_file_commit(&file, &diag);
		}
		code = err ? EXIT_CODE_INTERNAL : EXIT_CODE_OK;
	}
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return code;
}

static void print_mask(const struct wish *wish, const struct mask *mask)
{
	if (wish->json) {
		json_t *object =
			json_pack("{s:s, s:o}", "camera", wish->camera, "mask", mask_to_json(mask));

		print_json(object);
		return;
	}
	/* As the config wants it. */
	printf("mask:%s\n", mask->area_count ? "" : " []");
	for (uint32_t a = 0; a < mask->area_count; a++)
		printf("- {x: %d, y: %d, width: %d, height: %d}\n", mask->areas[a].x_px,
		       mask->areas[a].y_px, mask->areas[a].width_px, mask->areas[a].height_px);
}

/* It is in the file by now, so that a station that dies with it comes back with it. */
static int use(const struct wish *wish, const struct mask *mask)
{
	int code = set_mask(wish, mask);

	if (code != EXIT_CODE_OK && wish->save)
		fprintf(stderr, "stagectl: %s has the mask, but the station does not use it yet\n",
			wish->save);
	return code;
}

static int run(const struct wish *wish)
{
	bool live = !snapshot_is_address(wish->camera);
	struct mask mask = {0};
	int code = EXIT_CODE_OK;

	if (wish->find)
		code = find_mask(wish, &mask);
	else if (!wish->clear)
		code = get_mask(wish, &mask);
	if (code == EXIT_CODE_OK && wish->save)
		code = save(wish, &mask);
	if (code == EXIT_CODE_OK && live && (wish->find || wish->clear))
		code = use(wish, &mask);
	if (code == EXIT_CODE_OK)
		print_mask(wish, &mask);
	return code;
}

int verb_camera_mask(const struct verb *verb, int argc, char **argv)
{
	struct wish wish = {.socket_dir = DEFAULT_SOCKET_DIR, .seconds = SECONDS_DEFAULT};
	bool show = false;
	const struct argument arguments[] = {
		{"show", NULL, "print the camera's mask (what it does without an option)",
		 .flag = &show},
		{"auto", NULL, "mask what shines steadily on the empty stage", .flag = &wish.find},
		{"seconds", "S", "with --auto: how long to look (default 3)",
		 .number = &wish.seconds},
		{"clear", NULL, "take the mask away", .flag = &wish.clear},
		{"save", "FILE", "keep the mask in the file that the config's `masks` names",
		 .text = &wish.save},
		ARGUMENT_SOCKET_DIR(&wish.socket_dir),
		ARGUMENT_JSON(&wish.json),
		{0},
	};
	enum arguments_result parsed =
		arguments_parse(verb, arguments, argc, argv, &wish.camera, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	if (show + wish.find + wish.clear > 1) {
		fputs("stagectl: --show, --auto and --clear: one of them at a time\n", stderr);
		return EXIT_CODE_USAGE;
	}
	if (snapshot_is_address(wish.camera) && (!wish.find || wish.save)) {
		fputs("stagectl: a camera's address has no mask of its own: with it there is "
		      "--auto alone, which prints what the config wants\n",
		      stderr);
		return EXIT_CODE_USAGE;
	}
	return run(&wish);
}
