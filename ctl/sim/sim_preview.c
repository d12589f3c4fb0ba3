/*
 * stagectl sim preview: one instant of a scene as all its cameras see it, with the spots that are
 * found and the truth beside them.
 */
#include <errno.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/camera/sheet.h"
#include "ctl/print_json.h"
#include "sim/render/hd_render.h"
#include "sim/render/render.h"
#include "sim/sights.h"

#define LEGEND_MAX 24
#define BOARD_GROUP 3 /* a colour that neither paper nor ink has */

struct preview_options {
	struct sim_options scene;
	double at_s;
	bool whole, json;
	uint64_t width_px;
	const char *output;
};

struct preview {
	struct sim_scene *scene;
	uint64_t shot, hd_shot;
	uint32_t camera_count; /* HD included */
	struct snapshot *snapshots;
	struct sheet_tile *tiles;
	struct sim_sight sights[LABEL_MAX];
	struct sim_board_corner corners[BOARD_CORNER_MAX];
};

static bool is_hd(const struct preview *preview, uint32_t camera)
{
	return camera >= sim_scene_camera_count(preview->scene);
}

static int take_ir(struct preview *preview, uint32_t c, struct frame *frame)
{
	struct sim_renderer *renderer;
	int err = sim_renderer_create(&renderer, preview->scene, c, SIM_NOISE_FULL);

	if (err)
		return err;
	frame->pixels = sim_render(renderer, preview->shot, &frame->width_px, &frame->height_px);
	frame->stride_bytes = frame->width_px;
	frame->format = PIXEL_GREY8;
	err = snapshot_from_frame(&preview->snapshots[c], sim_scene_camera_name(preview->scene, c),
				  frame);
	sim_renderer_destroy(renderer);
	return err;
}

static int take_hd(struct preview *preview, uint32_t c, struct frame *frame)
{
	struct sim_hd_renderer *renderer;
	int err = sim_hd_renderer_create(&renderer, preview->scene, c);

	if (err)
		return err;
	frame->pixels =
		sim_hd_render(renderer, preview->hd_shot, &frame->width_px, &frame->height_px);
	frame->stride_bytes = frame->width_px;
	frame->format = PIXEL_BAYER_RG8;
	err = snapshot_from_frame(&preview->snapshots[c], sim_scene_camera_name(preview->scene, c),
				  frame);
	sim_hd_renderer_destroy(renderer);
	return err;
}

/* Marks the corners in place of markers and spots. */
static void mark_board(struct preview *preview, uint32_t c, struct sheet_tile *tile)
{
	uint64_t shot = is_hd(preview, c) ? preview->hd_shot : preview->shot;
	uint32_t count = sim_scene_board_sights(preview->scene, c, shot, preview->corners);
	uint32_t seen = 0;

	for (uint32_t i = 0; i < count; i++) {
		const struct sim_board_corner *corner = &preview->corners[i];

		if (!corner->seen)
			continue;
		sheet_add_mark(tile, SHEET_CROSS, corner->pixel[0], corner->pixel[1])->group =
			BOARD_GROUP;
		seen++;
	}
	snprintf(tile->caption, sizeof(tile->caption), "%s   %u of %u corners in sight",
		 tile->snapshot->camera, seen, count);
}

static void mark_markers(struct preview *preview, uint32_t c, struct sheet_tile *tile)
{
	const struct layout *layout = sim_scene_layout(preview->scene);
	uint32_t seen = 0;

	for (uint32_t m = 0; m < layout->marker_count; m++) {
		const struct sim_sight *sight = &preview->sights[m];

		if (!sight->seen)
			continue;
		struct sheet_mark *mark =
			sheet_add_mark(tile, SHEET_CROSS, sight->pixel[0], sight->pixel[1]);

		mark->group = sheet_group(layout, m);
		snprintf(mark->label, sizeof(mark->label), "%s", layout->markers[m].name);
		seen++;
	}
	if (is_hd(preview, c)) {
		snprintf(tile->caption, sizeof(tile->caption), "%s   %u markers in sight",
			 tile->snapshot->camera, seen);
		return;
	}
	uint32_t found = sheet_match_spots(tile);

	snprintf(tile->caption, sizeof(tile->caption),
		 "%s   %u spots found; %u of %u markers in sight have one", tile->snapshot->camera,
		 tile->snapshot->blob_count, found, seen);
}

static int take(struct preview *preview, uint32_t c)
{
	struct frame frame = {0};
	struct sheet_tile *tile = &preview->tiles[c];
	uint64_t shot = is_hd(preview, c) ? preview->hd_shot : preview->shot;
	int err = is_hd(preview, c) ? take_hd(preview, c, &frame) : take_ir(preview, c, &frame);

	if (!err)
		err = sim_scene_sights(preview->scene, c, shot, preview->sights);
	if (err)
		return err;
	tile->snapshot = &preview->snapshots[c];
	if (sim_scene_board_sights(preview->scene, c, shot, preview->corners))
		mark_board(preview, c, tile);
	else
		mark_markers(preview, c, tile);
	return 0;
}

static int take_all(struct preview *preview, double at_s)
{
	const struct sim_scene *scene = preview->scene;
	double period_s = 1e-9 * (double)sim_scene_period_ns(scene);
	uint64_t divider = sim_scene_hd_shot(scene, 1) - sim_scene_hd_shot(scene, 0);
	int err = 0;

	preview->shot = (uint64_t)(at_s / period_s);
	preview->hd_shot = sim_scene_hd_shot(scene, preview->shot / divider);
	preview->camera_count = sim_scene_camera_count(scene) + sim_scene_hd_count(scene);
	preview->snapshots = calloc(preview->camera_count, sizeof(*preview->snapshots));
	preview->tiles = calloc(preview->camera_count, sizeof(*preview->tiles));
	if (!preview->snapshots || !preview->tiles)
		return -ENOMEM;
	for (uint32_t c = 0; !err && c < preview->camera_count; c++)
		err = take(preview, c);
	return err;
}

static int write_sheet(struct preview *preview, const struct preview_options *options)
{
	const struct layout *layout = sim_scene_layout(preview->scene);
	struct sheet_legend legend[LEGEND_MAX];
	bool board = sim_scene_board_sights(preview->scene, 0, preview->shot, preview->corners) > 0;
	struct sheet sheet = {.whole = options->whole || board,
			      .width_px = options->width_px > INT_MAX ? 0 : (int)options->width_px,
			      .tile_count = preview->camera_count,
			      .tiles = preview->tiles,
			      .legend = legend};

	snprintf(sheet.title, sizeof(sheet.title), "%s, seed %llu: %.3f s, shot %llu",
		 options->scene.scene, (unsigned long long)options->scene.seed,
		 1e-9 * (double)sim_scene_mid_exposure_ns(preview->scene, preview->shot),
		 (unsigned long long)preview->shot);
	sheet.legend_count = board ? 0 : sheet_layout_legend(layout, legend, LEGEND_MAX);
	return sheet_write_png(&sheet, options->output);
}

static void finish(struct preview *preview)
{
	for (uint32_t c = 0; preview->snapshots && c < preview->camera_count; c++)
		snapshot_finish(&preview->snapshots[c]);
	free(preview->snapshots);
	free(preview->tiles);
	sim_scene_destroy(preview->scene);
	free(preview);
}

static void report(const struct preview *preview, const char *path, bool json)
{
	if (!json) {
		for (uint32_t c = 0; c < preview->camera_count; c++)
			puts(preview->tiles[c].caption);
		printf("written to %s\n", path);
		return;
	}
	json_t *object =
		json_pack("{s:s, s:I, s:i}", "file", path, "shot", (json_int_t)preview->shot,
			  "cameras", (int)preview->camera_count);
	print_json(object);
}

static int preview_scene(const struct preview_options *options)
{
	struct preview *preview = calloc(1, sizeof(*preview));
	struct diag diag = {0};
	int code = EXIT_CODE_OK;

	if (!preview)
		return EXIT_CODE_INTERNAL;
	int err = sim_scene_create(&preview->scene, &options->scene, &diag);

	if (err) {
		code = exit_code_of(err, EXIT_CODE_BAD_INPUT);
	} else if ((err = take_all(preview, options->at_s)) != 0 ||
		   (err = write_sheet(preview, options)) != 0) {
		diag_add(&diag, "%s: cannot write: %s", options->output, strerror(-err));
		code = EXIT_CODE_INTERNAL;
	} else {
		report(preview, options->output, options->json);
	}
	diag_print(&diag, stderr);
	diag_finish(&diag);
	finish(preview);
	return code;
}

/* "scenes/01-lips.yaml" -> "01-lips.png" */
static void default_path(char *path, size_t size, const char *scene)
{
	const char *slash = strrchr(scene, '/'), *file = slash ? slash + 1 : scene;

	snprintf(path, size, "%.*s.png", (int)strcspn(file, "."), file);
}

int verb_sim_preview(const struct verb *verb, int argc, char **argv)
{
	const char *scene;
	char path[300];
	uint64_t cameras = 0, hd = 0;
	struct preview_options options = {
		.scene = {.seed = 1, .hd_after_ir_ns = SIM_HD_AFTER_IR_NS}, .at_s = 1};
	const struct argument arguments[] = {
		{"at", "S", "at this time of the scene (default 1)", .number = &options.at_s},
		{"seed", "N", "of face, motion and noise (default 1)", .count = &options.scene.seed,
		 .count_max = UINT64_MAX},
		{"cameras", "N", "how many IR cameras (default: the scene's own)",
		 .count = &cameras},
		{"hd", "N", "HD cameras, 1 to 3 (default: the scene's own)", .count = &hd},
		{"width", "PX", "make the sheet smaller (default: as large as it gets)",
		 .count = &options.width_px},
		{"whole", NULL, "whole images (default: the part with the markers)",
		 .flag = &options.whole},
		{"output", "FILE.png", "write here (default: the scene's name)",
		 .text = &options.output},
		ARGUMENT_JSON(&options.json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &scene, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	options.scene.scene = scene;
	options.scene.camera_count = (uint32_t)cameras;
	options.scene.hd_camera_count = (uint32_t)hd;
	if (!options.output) {
		default_path(path, sizeof(path), scene);
		options.output = path;
	}
	return preview_scene(&options);
}
