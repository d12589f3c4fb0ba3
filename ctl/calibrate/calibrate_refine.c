/*
 * stagectl calibrate refine: cameras that were bumped or drifted are put right by some seconds of
 * named markers.
 */
#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "base/exit_codes.h"
#include "calib/rig/refine.h"
#include "calib/rig/rig_move.h"
#include "ctl/arguments.h"
#include "ctl/control_client.h"
#include "ctl/marker_feed.h"

#ifndef STAGE_VERSION
#error "STAGE_VERSION comes from meson"
#endif

#define SECONDS_DEFAULT 5

struct refine_verb {
	struct marker_feed_source source;
	bool json, dry_run;
	struct marker_feed *feed;
	struct refined refined;
	struct rig_moved moved; /* number 0: nothing was written */
};

static struct pose pose_now(const char *name, const struct pose *rt_cam_stage, const void *user)
{
	const struct refine_verb *verb = user;

	for (uint32_t c = 0; c < verb->refined.camera_count; c++)
		if (verb->refined.cameras[c].moved && !strcmp(verb->feed->stage.rig.names[c], name))
			return verb->refined.cameras[c].rt_cam_stage;
	return *rt_cam_stage;
}

static void put_details(char *details, size_t size, const struct refine_verb *verb)
{
	int at = snprintf(details, size, "shots: %u\nmarkers: %u\nmoved:\n",
			  verb->refined.shot_count, verb->refined.marker_count);

	for (uint32_t c = 0; c < verb->refined.camera_count; c++) {
		const struct refined_camera *camera = &verb->refined.cameras[c];

		if (camera->moved && at >= 0 && (size_t)at < size)
			at += snprintf(details + at, size - (size_t)at,
				       "- {camera: %s, off_px: %.3f, turned_mrad: %.3f, "
				       "moved_mm: %.3f}\n",
				       verb->feed->stage.rig.names[c], camera->off_px,
				       camera->turned_mrad, camera->moved_mm);
	}
}

static int write_rig(struct refine_verb *verb, struct diag *diag)
{
	const struct stage *stage = &verb->feed->stage;
	struct rig_move move = {.what = "refine",
				.software = "stage " STAGE_VERSION,
				.names = (const char(*)[NAME_BYTES])stage->rig.names,
				.count = stage->rig.camera_count,
				.pose = pose_now,
				.user = verb};

	put_details(move.details, sizeof(move.details), verb);
	return rig_move(&verb->moved, stage->config.rig_dir, &move, diag);
}

static json_t *camera_json(const char *name, const struct refined_camera *camera)
{
	return json_pack("{s:s, s:i, s:b, s:b, s:f, s:f, s:f, s:f, s:f}", "camera", name, "views",
			 (int)camera->view_count, "judged", camera->judged, "moved", camera->moved,
			 "off_px", camera->off_px, "turned_mrad", camera->turned_mrad, "moved_mm",
			 camera->moved_mm, "rms_before_px", camera->before_px, "rms_after_px",
			 camera->after_px);
}

static void print_json(const struct refine_verb *verb)
{
	const struct stage *stage = &verb->feed->stage;
	json_t *cameras = json_array();

	for (uint32_t c = 0; c < verb->refined.camera_count; c++)
		json_array_append_new(cameras,
				      camera_json(stage->rig.names[c], &verb->refined.cameras[c]));
	json_t *object = json_pack(
		"{s:s, s:i, s:i, s:i, s:o, s:o, s:o}", "rig", stage->config.rig_dir, "shots",
		(int)verb->refined.shot_count, "markers", (int)verb->refined.marker_count,
		"moved_count", (int)verb->refined.moved_count, "cameras", cameras, "number",
		verb->moved.number ? json_integer(verb->moved.number) : json_null(), "revision",
		verb->moved.number ? json_string(verb->moved.revision) : json_null());
	json_dumpf(object, stdout, JSON_COMPACT);
	putchar('\n');
	json_decref(object);
}

static void print_camera(const char *name, const struct refined_camera *camera)
{
	printf("%-12s %7u %9.3f %9.3f  ", name, camera->view_count, camera->before_px,
	       camera->after_px);
	if (camera->moved)
		printf("moved: was off by %.2f px, turned by %.3f mrad, shifted by %.2f mm\n",
		       camera->off_px, camera->turned_mrad, camera->moved_mm);
	else
		puts(camera->judged ? "as it was" : "not judged: it saw too few markers");
}

static void print_text(const struct refine_verb *verb)
{
	const struct stage *stage = &verb->feed->stage;

	if (verb->refined.named)
		printf("%u shots, %u markers\n", verb->refined.shot_count,
		       verb->refined.marker_count);
	else
		printf("%u shots, markers without names\n", verb->refined.shot_count);
	printf("%-12s %7s %9s %9s\n", "camera", "views", "before px", "after px");
	for (uint32_t c = 0; c < verb->refined.camera_count; c++)
		print_camera(stage->rig.names[c], &verb->refined.cameras[c]);
	if (!verb->refined.moved_count)
		printf("%s: all cameras look where it says; nothing was written\n",
		       stage->config.rig_dir);
	else if (verb->moved.number)
		printf("%s: revision %04u (%s), in force%s\n", stage->config.rig_dir,
		       verb->moved.number, verb->moved.revision,
		       verb->source.from ? "" : " and in use by the station");
}

static int swap_in(const struct refine_verb *verb)
{
	json_t *reply;
	int code =
		control_ask(&reply, verb->source.socket_dir, "org.stage.Control.ReloadRig", NULL);

	if (code == EXIT_CODE_OK)
		json_decref(reply);
	return code;
}

static int run(struct refine_verb *verb, struct diag *diag)
{
	int code = marker_feed_open(&verb->feed, &verb->source, diag);

	if (code != EXIT_CODE_OK)
		return code;
	int err = refine(&verb->refined, &verb->feed->stage.rig, &verb->feed->shots, diag);
	if (!err && verb->refined.moved_count && !verb->dry_run)
		err = write_rig(verb, diag);
	if (err)
		return err == -EBUSY ? EXIT_CODE_RUNNING
				     : (int)exit_code_of(err, EXIT_CODE_BAD_INPUT);
	if (verb->moved.number && !verb->source.from)
		code = swap_in(verb);
	if (verb->json)
		print_json(verb);
	else
		print_text(verb);
	return code;
}

int verb_calibrate_refine(const struct verb *verb, int argc, char **argv)
{
	struct refine_verb refine = {.source = {.socket_dir = DEFAULT_SOCKET_DIR}};
	struct diag diag = {0};
	uint64_t seconds = SECONDS_DEFAULT;
	const struct argument arguments[] = {
		{"from", "PATH", "a recording's directory or config (default: the station)",
		 .text = &refine.source.from},
		ARGUMENT_SOCKET_DIR(&refine.source.socket_dir),
		{"seconds", "N", "of the station's markers (default 5)", .count = &seconds},
		{"dry-run", NULL, "says who moved and writes nothing", .flag = &refine.dry_run},
		ARGUMENT_JSON(&refine.json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	refine.source.for_new_rig = !refine.dry_run;
	refine.source.seconds = (double)seconds;
	int code = run(&refine, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	marker_feed_close(refine.feed);
	return code;
}
