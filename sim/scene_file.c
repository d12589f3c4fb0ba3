/*
 * The keys of a scene file; scene_actors.c and scene_events.c read its two lists.
 */
#include "sim/scene_file.h"

#include <errno.h>
#include <limits.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "sim/cameras.h"
#include "sim/scene_file_parts.h"
#include "sim/scene_find.h"

#define SCENE_SIZE_MAX (1 << 20)
#define DEFAULT_SCENE "talking"
#define SECONDS_MAX 86400

static const char *const placements[] = {"face", "room", NULL};
static const char *const lenses[] = {"opencv8", "splined", NULL};
static const char *const optics[] = {"gaussian", "tailed", NULL};

static void read_faults(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	sim_faults_read(yaml, value, &((struct scene_reading *)target)->script.faults);
}

#define AT(member) offsetof(struct scene_reading, script.member)

static const struct yaml_key keys[] = {
	{"title", YAML_TEXT, AT(title), true, .size = SIM_TITLE_BYTES},
	{"comment", YAML_TEXT, AT(comment), .size = SIM_COMMENT_BYTES},
	{"seconds", YAML_DOUBLE, AT(seconds), true, .min = 0.1, .max = SECONDS_MAX,
	 .unit = "seconds"},
	{"rate_hz", YAML_DOUBLE, AT(rate_hz), .min = 1, .max = 1000, .unit = "hertz"},
	{"cameras", YAML_INT, AT(camera_count), .min = SIM_CAMERA_MIN, .max = SIM_CAMERA_MAX,
	 .unit = "IR cameras"},
	{"hd_cameras", YAML_INT, AT(hd_camera_count), .min = 0, .max = SIM_HD_MAX,
	 .unit = "HD cameras"},
	{"placement", YAML_CHOICE, AT(placement), .choices = placements},
	{"lens", YAML_CHOICE, AT(lens), .choices = lenses},
	{"optics", YAML_CHOICE, AT(optics), .choices = optics},
	{"ring_lights", YAML_BOOL, .offset = AT(ring_lights)},
	{"cross_strobes", YAML_BOOL, .offset = AT(cross_strobes)},
	{"ambient_grey", YAML_DOUBLE, AT(ambient_grey), .min = 0, .max = 200,
	 .unit = "grey values"},
	{"board", YAML_BOOL, .offset = AT(board)},
	{"actors", YAML_CUSTOM, .read = scene_read_actors},
	{"events", YAML_CUSTOM, .read = scene_read_events},
	{"faults", YAML_CUSTOM, .read = read_faults},
	{0},
};

static void set_name(struct sim_script *script, const char *path)
{
	const char *slash = strrchr(path, '/'), *file = slash ? slash + 1 : path;
	int length = (int)strcspn(file, ".");

	snprintf(script->name, sizeof(script->name), "%.*s", length, file);
}

static void set_defaults(struct sim_script *script, const char *path)
{
	memset(script, 0, sizeof(*script));
	set_name(script, path);
	script->rate_hz = 120;
	script->camera_count = SIM_CAMERA_MIN;
}

/* A scene's cameras are their own devices. */
static void name_devices(struct sim_faults *faults)
{
	for (uint32_t i = 0; i < faults->count; i++)
		memcpy(faults->faults[i].device, faults->faults[i].camera, NAME_BYTES);
}

static int read_script(struct scene_reading *reading, const char *path, struct diag *diag)
{
	struct yaml yaml;
	int err = yaml_open(&yaml, path, SCENE_SIZE_MAX, diag);

	if (err)
		return err;
	struct yaml_value root = yaml_root(&yaml);

	memset(reading, 0, sizeof(*reading));
	set_defaults(&reading->script, path);
	yaml_read_mapping(&yaml, &root, keys, reading, NULL);
	name_devices(&reading->script.faults);
	err = yaml.failed ? -EINVAL : 0;
	yaml_close(&yaml);
	return err;
}

static int override_optics(struct sim_script *script, const char *name, struct diag *diag)
{
	for (int i = 0; optics[i]; i++)
		if (strcmp(optics[i], name) == 0) {
			script->optics = i;
			return 0;
		}
	diag_add(diag, "sim: no optics '%.64s': use gaussian or tailed", name);
	return -EINVAL;
}

static int override(struct sim_script *script, const struct sim_options *options, struct diag *diag)
{
	if (options->camera_count)
		script->camera_count = options->camera_count;
	if (options->hd_camera_count)
		script->hd_camera_count = options->hd_camera_count;
	if (options->rate_hz > 0)
		script->rate_hz = options->rate_hz;
	return options->optics ? override_optics(script, options->optics, diag) : 0;
}

int sim_script_load(struct sim_script *out, const struct sim_options *options, struct diag *diag)
{
	static struct scene_reading reading; /* control thread only; too large for its stack */
	const char *scene = options->scene && *options->scene ? options->scene : DEFAULT_SCENE;
	char path[PATH_MAX];
	int err = scene_find(path, scene, diag);

	if (!err)
		err = read_script(&reading, path, diag);
	if (!err)
		err = override(&reading.script, options, diag);
	if (!err)
		*out = reading.script;
	return err;
}
