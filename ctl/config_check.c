/*
 * stagectl config check: everything that can be known about a config without touching a device,
 * every error in one run.
 */
#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/layout_warnings.h"
#include "ctl/print_json.h"
#include "ctl/program_drivers.h"
#include "drivers/open_cameras.h"
#include "sim/world/scene.h"

/* Recordings are files too: their first images are opened to compare sizes. */
static uint32_t recorded_cameras(const struct config *config)
{
	uint32_t mask = 0;

	for (uint32_t c = 0; c < config->camera_count; c++)
		if (strncmp(config->cameras[c].address, "files:", 6) == 0)
			mask |= UINT32_C(1) << c;
	return mask;
}

/* A live device is not touched, but its driver must be one that there is, */
static void ask_camera(const char *address, struct diag *diag)
{
	const char *rest;

	camera_driver_find(live_drivers, address, &rest, diag);
}

/* and a trigger's address and both plans that it may be armed with such that it can do them. */
static void ask_trigger(const struct config *config, bool plans_are_good, struct diag *diag)
{
	const char *rest;
	const struct trigger_driver *driver =
		trigger_driver_find(live_triggers, config->trigger, &rest, diag);

	if (!driver || !driver->check)
		return;
	if (!plans_are_good)
		driver->check(rest, NULL, diag);
	else if (driver->check(rest, &config->plan, diag) == 0)
		driver->check(rest, &config->calibration_plan, diag);
}

static const struct config_drivers live = {ask_camera, ask_trigger};

static int check_scene(const struct config *config, struct diag *diag)
{
	struct sim_options options = {.scene = config->sim_scene, .seed = config->sim_seed};
	struct sim_scene *scene = NULL;
	int err = sim_scene_create(&scene, &options, diag);

	sim_scene_destroy(scene);
	return err;
}

static int check(struct stage *stage, const char *path, struct diag *diag)
{
	struct open_camera cameras[CAMERA_MAX] = {0};
	int err = stage_load_for(stage, path, &live, diag);

	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	int scene_err = check_scene(&stage->config, diag);

	err = open_cameras(cameras, stage, recorded_cameras(&stage->config), recording_drivers, 0,
			   diag);
	close_cameras(cameras, stage->config.camera_count);
	if (err == -ENOMEM || scene_err == -ENOMEM)
		return EXIT_CODE_INTERNAL;
	return err || scene_err ? EXIT_CODE_BAD_INPUT : EXIT_CODE_OK;
}

static uint32_t count_rigid(const struct layout *layout, const struct layout_actor *actor)
{
	uint32_t count = 0;

	for (uint32_t m = actor->first; m < actor->first + actor->count; m++)
		count += layout->markers[m].rigid;
	return count;
}

static void print_warnings(const struct stage *stage)
{
	json_t *found = layout_warnings(stage), *one;
	size_t index;

	json_array_foreach(found, index, one) printf("warning  %s\n", json_string_value(one));
	json_decref(found);
}

static void print_layouts(const struct stage *stage)
{
	for (uint32_t a = 0; a < stage->layout.actor_count; a++) {
		const struct layout_actor *actor = &stage->layout.actors[a];

		printf("layout   %s, %u markers, %u of them rigid%s%s\n",
		       stage->config.layout_paths[a], actor->count,
		       count_rigid(&stage->layout, actor), actor->name[0] ? ", actor " : "",
		       actor->name);
	}
}

static void print_summary(const struct stage *stage)
{
	const struct config *config = &stage->config;

	printf("%s: good\n", config->path);
	printf("rig      %s, revision %s\n", config->rig_dir, stage->rig.revision);
	print_layouts(stage);
	printf("trigger  %s, %.3f Hz\n", config->trigger, 1e9 / (double)config->plan.period_ns);
	for (uint32_t c = 0; c < config->camera_count; c++) {
		const struct config_camera *camera = &config->cameras[c];

		printf("camera   %-12s %-3s %s\n", camera->name,
		       camera->role == ROLE_IR ? "ir" : "hd", camera->address);
	}
	print_warnings(stage);
}

static json_t *layouts_json(const struct stage *stage)
{
	json_t *layouts = json_array();

	for (uint32_t a = 0; a < stage->layout.actor_count; a++) {
		const struct layout_actor *actor = &stage->layout.actors[a];

		json_array_append_new(layouts,
				      json_pack("{s:s, s:s, s:I}", "layout",
						stage->config.layout_paths[a], "actor", actor->name,
						"markers", (json_int_t)actor->count));
	}
	return layouts;
}

static json_t *summary_json(const struct stage *stage)
{
	const struct config *config = &stage->config;
	json_t *cameras = json_array();

	for (uint32_t c = 0; c < config->camera_count; c++)
		json_array_append_new(cameras,
				      json_pack("{s:s, s:s, s:s}", "name", config->cameras[c].name,
						"address", config->cameras[c].address, "role",
						config->cameras[c].role == ROLE_IR ? "ir" : "hd"));
	return json_pack("{s:s, s:s, s:s, s:o, s:I, s:s, s:o}", "config", config->path, "rig",
			 config->rig_dir, "rig_revision", stage->rig.revision, "layouts",
			 layouts_json(stage), "markers", (json_int_t)stage->layout.marker_count,
			 "trigger", config->trigger, "cameras", cameras);
}

static json_t *errors_json(const struct diag *diag)
{
	json_t *errors = json_array();
	const char *line = diag->text ? diag->text : "";

	for (const char *end; (end = strchr(line, '\n')); line = end + 1)
		json_array_append_new(errors, json_stringn(line, (size_t)(end - line)));
	return errors;
}

static void print_verdict(const struct stage *stage, const struct diag *diag, bool good)
{
	json_t *object = good ? summary_json(stage) : json_object();

	if (good)
		json_object_set_new(object, "warnings", layout_warnings(stage));
	json_object_set_new(object, "good", json_boolean(good));
	json_object_set_new(object, "errors", errors_json(diag));
	print_json(object);
}

int verb_config_check(const struct verb *verb, int argc, char **argv)
{
	const char *path;
	bool json = false;
	struct diag diag = {0};
	const struct argument arguments[] = {
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &path, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	struct stage *stage = calloc(1, sizeof(*stage));
	if (!stage)
		return EXIT_CODE_INTERNAL;
	int code = check(stage, path, &diag);
	if (json)
		print_verdict(stage, &diag, code == EXIT_CODE_OK);
	else if (code == EXIT_CODE_OK)
		print_summary(stage);
	else
		diag_print(&diag, stderr);
	diag_finish(&diag);
	stage_finish(stage);
	free(stage);
	return code;
}
