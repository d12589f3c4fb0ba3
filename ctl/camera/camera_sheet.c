/*
 * Images come over the control socket, markers over the stream. A marker set is laid over the image
 * that was exposed at the same time, through the rig that the station's config names.
 */
#include "ctl/camera/camera_sheet.h"

#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "config/stage.h"
#include "ctl/camera/sheet.h"
#include "ctl/control_client.h"
#include "ctl/print_json.h"
#include "protocol/stage_client.h"

#define LEGEND_MAX 24
#define SET_WAIT_NS NS_PER_S
#define SAME_EXPOSURE_NS (1 * NS_PER_MS)

struct gathering {
	json_t *status;              /* of the reply */
	struct stage *stage;         /* owned; NULL: its config cannot be read here */
	struct stage_client *client; /* owned; NULL: nothing streams */
	uint32_t count;
	uint64_t shot; /* of the marker set used last */
	struct snapshot snapshots[CAMERA_MAX];
	struct sheet_tile tiles[CAMERA_MAX];
};

/* Names need the rig. Without it the sheet has spots alone, and the reason is told. */
static void open_names(struct gathering *all, const char *socket_dir)
{
	const char *config = json_string_value(json_object_get(all->status, "config"));
	struct diag diag = {0};
	char path[PATH_MAX];
	int err;

	all->stage = calloc(1, sizeof(*all->stage));
	err = all->stage && config ? stage_load(all->stage, config, &diag) : -ENOMEM;
	if (err) {
		free(all->stage);
		all->stage = NULL;
		fprintf(stderr, "stagectl: no names: the station's config cannot be read here\n");
		diag_print(&diag, stderr);
	}
	diag_finish(&diag);
	snprintf(path, sizeof(path), "%s/stream.sock", socket_dir);
	if (all->stage && (err = stage_client_open(&all->client, path)) != 0)
		fprintf(stderr, "stagectl: no names: %s: %s\n", path, strerror(-err));
}

static void mark_marker(struct sheet_tile *tile, const struct stage *stage, const struct view *view,
			const struct stage_marker *marker)
{
	struct vec3 p = {marker->p_m[0], marker->p_m[1], marker->p_m[2]};
	double pixel[2];

	if (!isfinite(p.x) || !view_project(view, p, pixel, NULL))
		return;
	struct sheet_mark *mark = sheet_add_mark(tile, SHEET_CROSS, pixel[0], pixel[1]);

	if (marker->label < 0 || (uint32_t)marker->label >= stage->layout.marker_count)
		return;
	mark->group = sheet_group(&stage->layout, (uint32_t)marker->label);
	snprintf(mark->label, sizeof(mark->label), "%s", stage->layout.markers[marker->label].name);
}

/* Markers that the camera had a part in, or that nobody saw; those turned away from it are not. */
static void mark_set(struct gathering *all, struct sheet_tile *tile, uint32_t camera,
		     const struct stage_marker_set *set)
{
	const struct view *view = &all->stage->rig.views[all->stage->view_index[camera]];

	all->shot = set->shot;
	for (uint32_t m = 0; m < set->marker_count; m++)
		if (set->markers[m].camera_mask == 0 || set->markers[m].camera_mask >> camera & 1)
			mark_marker(tile, all->stage, view, &set->markers[m]);
}

/* Reads the stream on to the set of that exposure. */
static void add_markers(struct gathering *all, struct sheet_tile *tile, uint32_t camera)
{
	int64_t wanted_ns = tile->snapshot->mid_exposure_ns;
	int64_t give_up_ns = clock_real_now_ns() + SET_WAIT_NS;
	struct stage_event event;

	while (all->client && clock_real_now_ns() < give_up_ns) {
		int err = stage_client_next(all->client, 100, &event);

		if (err && err != -ETIMEDOUT)
			return;
		if (err || event.kind != STAGE_MARKERS ||
		    event.markers->mid_exposure_ns < wanted_ns - SAME_EXPOSURE_NS)
			continue;
		if (event.markers->mid_exposure_ns <= wanted_ns + SAME_EXPOSURE_NS)
			mark_set(all, tile, camera, event.markers);
		return;
	}
}

static int add_camera(struct gathering *all, const char *socket_dir, const char *name,
		      uint32_t camera)
{
	struct snapshot *snapshot = &all->snapshots[all->count];
	struct sheet_tile *tile = &all->tiles[all->count];
	int code = snapshot_from_station(snapshot, socket_dir, name);

	if (code)
		return code;
	all->count++;
	tile->snapshot = snapshot;
	if (snapshot->format != PIXEL_GREY8) {
		snprintf(tile->caption, sizeof(tile->caption), "%s", name);
		return EXIT_CODE_OK;
	}
	if (all->stage && all->stage->view_index[camera] != VIEW_NONE)
		add_markers(all, tile, camera);
	uint32_t crosses = tile->mark_count, found = sheet_match_spots(tile);

	if (crosses)
		snprintf(tile->caption, sizeof(tile->caption),
			 "%s   shot %" PRIu64 ": %u spots; %u of %u markers have one", name,
			 all->shot, snapshot->blob_count, found, crosses);
	else
		snprintf(tile->caption, sizeof(tile->caption), "%s   %u spots", name,
			 snapshot->blob_count);
	return EXIT_CODE_OK;
}

/* Cameras that do not run are told and left out. */
static int add_cameras(struct gathering *all, const char *socket_dir)
{
	json_t *cameras = json_object_get(all->status, "cameras"), *camera;
	size_t index;
	int code = EXIT_CODE_OK;

	json_array_foreach(cameras, index, camera)
	{
		const char *name = json_string_value(json_object_get(camera, "name"));
		const char *state = json_string_value(json_object_get(camera, "state"));

		if (code || !name || index >= CAMERA_MAX)
			break;
		if (state && strcmp(state, "running") == 0)
			code = add_camera(all, socket_dir, name, (uint32_t)index);
		else
			fprintf(stderr, "stagectl: camera %s is left out: %s\n", name,
				state ? state : "not running");
	}
	return code;
}

static int write_sheet(struct gathering *all, const struct camera_sheet_options *options)
{
	struct sheet_legend legend[LEGEND_MAX];
	struct sheet sheet = {.whole = options->whole,
			      .tile_count = all->count,
			      .tiles = all->tiles,
			      .legend = legend};

	if (all->stage)
		sheet.legend_count = sheet_layout_legend(&all->stage->layout, legend, LEGEND_MAX);
	snprintf(sheet.title, sizeof(sheet.title), "%u cameras, %s", all->count,
		 options->socket_dir);
	int err = sheet_write_png(&sheet, options->output);

	if (!err)
		return EXIT_CODE_OK;
	fprintf(stderr, "stagectl: %s: cannot write: %s\n", options->output, strerror(-err));
	return EXIT_CODE_INTERNAL;
}

static void report(const struct gathering *all, const struct camera_sheet_options *options)
{
	json_t *captions = json_array();

	for (uint32_t c = 0; c < all->count; c++) {
		if (!options->json)
			puts(all->tiles[c].caption);
		json_array_append_new(captions, json_string(all->tiles[c].caption));
	}
	json_t *object = json_pack("{s:s, s:o}", "file", options->output, "cameras", captions);

	if (options->json) {
		print_json(object);
		return;
	}
	printf("written to %s\n", options->output);
	json_decref(object);
}

static void finish(struct gathering *all, json_t *reply)
{
	stage_client_close(all->client);
	if (all->stage)
		stage_finish(all->stage);
	free(all->stage);
	for (uint32_t c = 0; c < all->count; c++)
		snapshot_finish(&all->snapshots[c]);
	free(all);
	json_decref(reply);
}

int camera_sheet(const struct camera_sheet_options *options)
{
	struct gathering *all = calloc(1, sizeof(*all));
	json_t *reply = NULL;

	if (!all)
		return EXIT_CODE_INTERNAL;
	int code = control_ask(&reply, options->socket_dir, "org.stage.Control.GetStatus", NULL);

	if (!code) {
		all->status = json_object_get(reply, "status");
		open_names(all, options->socket_dir);
		code = add_cameras(all, options->socket_dir);
	}
	if (!code && !all->count) {
		fprintf(stderr, "stagectl: no camera runs; stagectl start\n");
		code = EXIT_CODE_DEVICE;
	}
	if (!code)
		code = write_sheet(all, options);
	if (!code)
		report(all, options);
	finish(all, reply);
	return code;
}
