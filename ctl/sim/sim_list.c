/*
 * stagectl sim list: the scenes that can be played, and what is in them.
 */
#include <jansson.h>
#include <stdio.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/print_json.h"
#include "sim/world/scene_file.h"
#include "sim/world/scene_find.h"

static int marker_count(const struct sim_script *script)
{
	int count = 0;

	for (uint32_t a = 0; a < script->actor_count; a++)
		count += script->actors[a].face_markers + script->actors[a].body_markers;
	return count;
}

/* Something comes between markers and cameras. */
static bool has_occluders(const struct sim_script *script)
{
	for (uint32_t a = 0; a < script->actor_count; a++)
		if (script->actor_count > 1 || script->actors[a].body_markers > 0)
			return true;
	for (uint32_t e = 0; e < script->event_count; e++)
		if (script->events[e].kind == SIM_EVENT_HAND ||
		    script->events[e].kind == SIM_EVENT_PASSER)
			return true;
	return false;
}

/* When its events and faults begin. */
static json_t *times_json(const struct sim_script *script)
{
	json_t *times = json_array();

	for (uint32_t e = 0; e < script->event_count; e++)
		json_array_append_new(times, json_real(script->events[e].at_s));
	for (uint32_t f = 0; f < script->faults.count; f++)
		json_array_append_new(times, json_real(script->faults.faults[f].at_s));
	return times;
}

static json_t *scene_json(const struct sim_script *script)
{
	return json_pack("{s:s, s:s, s:s, s:f, s:i, s:i, s:i, s:i, s:i, s:i, s:f, s:b, s:o}",
			 "name", script->name, "title", script->title, "comment", script->comment,
			 "seconds", script->seconds, "actors", (int)script->actor_count, "markers",
			 marker_count(script), "cameras", (int)script->camera_count, "hd_cameras",
			 (int)script->hd_camera_count, "events", (int)script->event_count, "faults",
			 (int)script->faults.count, "rate_hz", script->rate_hz, "occluders",
			 (int)has_occluders(script), "happens_at_s", times_json(script));
}

static void print_scene(const struct sim_script *script)
{
	printf("%-24s %7g %6u %7d %7u %6u %6u  %s\n", script->name, script->seconds,
	       script->actor_count, marker_count(script), script->camera_count, script->event_count,
	       script->faults.count, script->title);
}

/* Prints a scene, or adds it to `list`; what cannot be read is told behind the others. */
static int show(const char *name, json_t *list, struct diag *diag)
{
	static struct sim_script script; /* large */
	struct sim_options options = {.scene = name};
	int err = sim_script_load(&script, &options, diag);

	if (!err && list)
		json_array_append_new(list, scene_json(&script));
	else if (!err)
		print_scene(&script);
	return err;
}

int verb_sim_list(const struct verb *verb, int argc, char **argv)
{
	static char names[SCENE_NAMES_MAX][NAME_BYTES];
	bool json = false;
	size_t count = 0;
	struct diag diag = {0};
	const struct argument arguments[] = {
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	int err = scene_names(names, &count, &diag);
	json_t *list = json ? json_array() : NULL;

	if (!json && !err)
		printf("%-24s %7s %6s %7s %7s %6s %6s  %s\n", "NAME", "SECONDS", "ACTORS",
		       "MARKERS", "CAMERAS", "EVENTS", "FAULTS", "TITLE");
	for (size_t i = 0; !err && i < count; i++)
		show(names[i], list, &diag);
	if (json) {
		json_t *object = json_pack("{s:o}", "scenes", list);

		print_json(object);
	}
	diag_print(&diag, stderr);
	err = err || diag.count;
	diag_finish(&diag);
	return err ? EXIT_CODE_BAD_INPUT : EXIT_CODE_OK;
}
