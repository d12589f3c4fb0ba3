/*
 * stagectl camera preview: one image to look at, with the spots found in it circled; or all cameras
 * of the station on one sheet.
 */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/camera/camera_sheet.h"
#include "ctl/camera/snapshot.h"
#include "ctl/print_json.h"

#define ALL_CAMERAS "all"

/* "sim:ir3" -> "sim_ir3.png" */
static void default_path(char *path, size_t size, const char *camera)
{
	snprintf(path, size - 4, "%s", camera);
	for (char *c = path; *c; c++)
		if (*c == ':' || *c == '/')
			*c = '_';
	strcat(path, ".png");
}

static void report(const struct snapshot *snapshot, const char *path, bool json)
{
	if (!json) {
		printf("%s: %dx%d, %u spots, written to %s\n", snapshot->camera, snapshot->width_px,
		       snapshot->height_px, snapshot->blob_count, path);
		return;
	}
	json_t *object = json_pack("{s:s, s:i, s:i, s:I, s:i, s:s}", "camera", snapshot->camera,
				   "width_px", snapshot->width_px, "height_px", snapshot->height_px,
				   "mid_exposure_ns", (json_int_t)snapshot->mid_exposure_ns,
				   "blobs", (int)snapshot->blob_count, "file", path);
	print_json(object);
}

int verb_camera_preview(const struct verb *verb, int argc, char **argv)
{
	const char *camera, *output = NULL, *socket_dir = DEFAULT_SOCKET_DIR;
	char path[300];
	bool whole = false, json = false;
	const struct argument arguments[] = {
		{"output", "FILE.png", "write here (default: the camera's name)", .text = &output},
		ARGUMENT_SOCKET_DIR(&socket_dir),
		{"whole", NULL, "of all: whole images (default: the part with the markers)",
		 .flag = &whole},
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &camera, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	if (strcmp(camera, ALL_CAMERAS) == 0)
		return camera_sheet(&(struct camera_sheet_options){
			socket_dir, output ? output : "cameras.png", whole, json});
	struct snapshot *snapshot = calloc(1, sizeof(*snapshot));
	if (!snapshot)
		return EXIT_CODE_INTERNAL;
	int code = snapshot_is_address(camera)
			   ? snapshot_from_address(snapshot, camera)
			   : snapshot_from_station(snapshot, socket_dir, camera);
	if (!output) {
		default_path(path, sizeof(path), camera);
		output = path;
	}
	if (code == EXIT_CODE_OK) {
		int err = snapshot_write_png(snapshot, output);

		if (err) {
			fprintf(stderr, "stagectl: %s: cannot write: %s\n", output, strerror(-err));
			code = EXIT_CODE_INTERNAL;
		} else {
			report(snapshot, output, json);
		}
	}
	snapshot_finish(snapshot);
	free(snapshot);
	return code;
}
