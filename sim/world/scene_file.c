/*
 * The keys of a scene file; scene_actors.c and scene_events.c read its two lists.
 */
#include "sim/world/scene_file.h"

#include <errno.h>
#include <limits.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "sim/cameras.h"
#include "sim/world/scene_file_parts.h"
#include "sim/world/scene_find.h"

#define SCENE_SIZE_MAX (1 << 20)
#define DEFAULT_SCENE "talking"
#define SECONDS_MAX 86400

/* The rows of a picture fit between two of them. */
#define HD_ROW_MAX_US 25

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
	{"hd_row_us", YAML_DOUBLE, AT(hd_row_us), .min = 0, .max = HD_ROW_MAX_US,
	 .unit = "microseconds"},
	{0},
};

enum { KEY_BOARD = 12, KEY_ACTORS };

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

/* -1: none of that name. */
static int find_optics(const char *name)
{
	for (int i = 0; optics[i]; i++)
		if (strcmp(optics[i], name) == 0)
			return i;
	return -1;
}

static int check_options(const struct sim_options *options, struct diag *diag)
{
	uint32_t count = options->camera_count;

	if (count && (count < SIM_CAMERA_MIN || count > SIM_CAMERA_MAX))
		diag_add(diag, "sim: %u cameras: a scene has %d to %d", count, SIM_CAMERA_MIN,
			 SIM_CAMERA_MAX);
	else if (options->hd_camera_count > SIM_HD_MAX)
		diag_add(diag, "sim: %u HD cameras: a scene has up to %d", options->hd_camera_count,
			 SIM_HD_MAX);
	else if (!(options->rate_hz == 0 || (options->rate_hz >= 1 && options->rate_hz <= 1000)))
		diag_add(diag, "sim: %g Hz: a scene runs at 1 to 1000 Hz", options->rate_hz);
	else if (options->optics && find_optics(options->optics) < 0)
		diag_add(diag, "sim: no optics '%.64s': use gaussian or tailed", options->optics);
	else if (!(options->face_speed_m_s >= 0 && options->face_speed_m_s <= 3))
		diag_add(diag, "sim: a face at %g m/s: up to 3 can be played",
			 options->face_speed_m_s);
	else
		return 0;
	return -EINVAL;
}

/* The same stage without its actors and what befalls them; its devices' faults stay. */
static void wave_board(struct sim_script *script)
{
	script->board = true;
	script->actor_count = 0;
	script->event_count = 0;
}

static void override(struct sim_script *script, const struct sim_options *options)
{
	if (options->camera_count)
		script->camera_count = options->camera_count;
	if (options->hd_camera_count)
		script->hd_camera_count = options->hd_camera_count;
	if (options->rate_hz > 0)
		script->rate_hz = options->rate_hz;
	if (options->optics)
		script->optics = find_optics(options->optics);
	for (uint32_t a = 0; a < script->actor_count && options->face_speed_m_s > 0; a++)
		script->actors[a].face_speed_m_s = options->face_speed_m_s;
}

/* Behind the scene's own. */
static int add_faults(struct sim_script *script, const struct sim_faults *more, struct diag *diag)
{
	struct sim_faults *faults = &script->faults;

	for (uint32_t i = 0; more && i < more->count; i++) {
		if (faults->count == SIM_FAULT_MAX) {
			diag_add(diag, "sim: more than %d faults with those of scene %s",
				 SIM_FAULT_MAX, script->name);
			return -EINVAL;
		}
		faults->faults[faults->count++] = more->faults[i];
	}
	return 0;
}

static void read_root(struct yaml *yaml, const struct yaml_value *root,
		      struct scene_reading *reading)
{
	struct sim_script *script = &reading->script;
	struct yaml_place places[sizeof(keys) / sizeof(*keys)];

	memset(places, 0, sizeof(places));
	yaml_read_mapping(yaml, root, keys, reading, places);
	reading->own_camera_count = script->camera_count;
	reading->own_hd_camera_count = script->hd_camera_count;
	name_devices(&script->faults);
	if (!places[KEY_ACTORS].line && !script->board)
		yaml_complain(yaml, root->place, "actors",
			      "missing: a scene has actors or board: true");
	else if (!script->actor_count && !script->board && !yaml->failed)
		yaml_complain(yaml, places[KEY_ACTORS], "actors",
			      "nobody is in the list: a scene has actors or board: true");
	else if (script->board && script->actor_count)
		yaml_complain(yaml, places[KEY_BOARD], "board",
			      "a board is waved instead of actors, not beside them");
}

static int read_script(struct scene_reading *reading, const char *path,
		       const struct sim_options *options, struct diag *diag)
{
	struct yaml yaml;
	int err = yaml_open(&yaml, path, SCENE_SIZE_MAX, diag);

	if (err)
		return err;
	struct yaml_value root = yaml_root(&yaml);

	memset(reading, 0, sizeof(*reading));
	set_defaults(&reading->script, path);
	read_root(&yaml, &root, reading);
	override(&reading->script, options);
	scene_check_actors(&yaml, reading, options->seed);
	scene_check_events(&yaml, reading);
	scene_check_faults(&yaml, reading);
	if (options->board)
		wave_board(&reading->script);
	err = yaml.failed ? -EINVAL : 0;
	yaml_close(&yaml);
	return err;
}

int sim_script_load(struct sim_script *out, const struct sim_options *options, struct diag *diag)
{
	static struct scene_reading reading; /* control thread only; too large for its stack */
	const char *scene = options->scene && *options->scene ? options->scene : DEFAULT_SCENE;
	char path[PATH_MAX];
	int err = check_options(options, diag);

	if (!err)
		err = scene_find(path, scene, diag);
	if (!err)
		err = read_script(&reading, path, options, diag);
	if (!err)
		err = add_faults(&reading.script, options->faults, diag);
	if (!err)
		*out = reading.script;
	return err;
}
