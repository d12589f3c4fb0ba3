/*
 * The keys of the configuration file, their limits and defaults. docs/configuration.md explains
 * them to the operator.
 */
#include "config/config.h"

#include <errno.h>
#include <libgen.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "base/clock.h"
#include "config/addresses.h"
#include "config/config_camera.h"
#include "config/masks.h"
#include "config/plan.h"
#include "config/yaml.h"

#define CONFIG_SIZE_MAX (1 << 20)
#define SOCKET_NAME_MAX                                                          \
	20 /* "/control.sock" and the like, in the 108 bytes of a socket address \
	    */

#define AT(member) offsetof(struct config, member)
#define NUMBER(what, member, low, high, words) \
	.kind = (what), .offset = AT(member), .min = (low), .max = (high), .unit = (words)

/* What one run over the file fills; the keys' offsets are of the config in front. */
struct reading {
	struct config config;
	struct plan_places plan;
};

static const struct yaml_key blob_keys[] = {
	{"threshold_sigma",
	 NUMBER(YAML_DOUBLE, blobs.threshold_sigma, 1, 100, "sigma of the noise")},
	{"threshold_min", NUMBER(YAML_DOUBLE, blobs.threshold_min, 0, 254, "grey values")},
	{"electrons_per_grey", NUMBER(YAML_DOUBLE, blobs.electrons_per_grey, 0.01, 1e5, NULL)},
	{"area_min_px", NUMBER(YAML_INT, blobs.area_min_px, 1, 10000, "pixels")},
	{"area_max_px", NUMBER(YAML_INT, blobs.area_max_px, 1, 1e8, "pixels")},
	{0},
};

static const struct yaml_key tracking_keys[] = {
	{"match_gate_px", NUMBER(YAML_DOUBLE, tracking.match_gate_px, 0.01, 100, "pixels")},
	{"calibration_sigma_px",
	 NUMBER(YAML_DOUBLE, tracking.calibration_sigma_px, 0, 10, "pixels")},
	{"range_min_m", NUMBER(YAML_DOUBLE, tracking.range_min_m, 0, 1000, "metres")},
	{"range_max_m", NUMBER(YAML_DOUBLE, tracking.range_max_m, 0.01, 1000, "metres")},
	{0},
};

static const char *const sim_clocks[] = {"real", "virtual", "stepped", NULL};

static void read_faults(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	sim_faults_read(yaml, value, &((struct config *)target)->sim_faults);
}

enum { SIM_SCENE, SIM_SEED, SIM_EPOCH, SIM_CLOCK, SIM_FAULTS, SIM_KEY_COUNT };

static const struct yaml_key sim_keys[SIM_KEY_COUNT + 1] = {
	[SIM_SCENE] = {"scene", YAML_TEXT, AT(sim_scene), .size = PATH_MAX},
	[SIM_SEED] = {"seed", YAML_UINT64, .offset = AT(sim_seed)},
	[SIM_EPOCH] = {"epoch_ns", YAML_INT64, .offset = AT(sim_epoch_ns)},
	[SIM_CLOCK] = {"clock", YAML_CHOICE, AT(sim_clock), .choices = sim_clocks},
	[SIM_FAULTS] = {"faults", YAML_CUSTOM, .read = read_faults},
};

static void read_rate(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	const struct yaml_key rate = {"rate_hz", YAML_DOUBLE, .min = 1, .max = 1000,
				      .unit = "hertz"};
	struct config *config = target;
	double rate_hz = 0;

	yaml_read_scalar(yaml, value, &rate, &rate_hz);
	if (rate_hz > 0)
		config->plan.period_ns = llround((double)NS_PER_S / rate_hz);
}

static void read_blobs(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	const struct blob_settings *blobs = &((struct config *)target)->blobs;

	yaml_read_mapping(yaml, value, blob_keys, target, NULL);
	if (blobs->area_max_px < blobs->area_min_px)
		yaml_complain(yaml, value->place, "blobs.area_max_px",
			      "%d is below area_min_px, which is %d", blobs->area_max_px,
			      blobs->area_min_px);
}

static void read_tracking(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	const struct tracker_settings *tracking = &((struct config *)target)->tracking;

	yaml_read_mapping(yaml, value, tracking_keys, target, NULL);
	if (tracking->range_max_m <= tracking->range_min_m)
		yaml_complain(yaml, value->place, "tracking.range_max_m",
			      "%g is not above range_min_m, which is %g", tracking->range_max_m,
			      tracking->range_min_m);
}

static void read_sim(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct config *config = target;
	struct yaml_place places[SIM_KEY_COUNT + 1];

	memset(places, 0, sizeof(places));
	yaml_read_mapping(yaml, value, sim_keys, target, places);
	config->sim_clock_line = places[SIM_CLOCK].line;
	config->sim_clock_column = places[SIM_CLOCK].column;
}

static void read_camera(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	camera_read(yaml, value, target);
}

static void read_cameras(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	int count = yaml_read_list(yaml, value, CAMERA_MAX, "cameras", read_camera, target);

	if (count == 0 && fy_node_is_sequence(value->node))
		yaml_complain(yaml, value->place, value->field, "no camera in the list");
}

static void read_layout(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	static const struct yaml_key path = {"layout", YAML_TEXT, .size = PATH_MAX};
	struct config *config = target;

	if (config->layout_count == ACTOR_MAX)
		yaml_complain(yaml, value->place, value->field, "more than %d layouts", ACTOR_MAX);
	else
		yaml_read_scalar(yaml, value, &path, config->layout_paths[config->layout_count++]);
}

static void read_layouts(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct yaml_value item;
	char field[YAML_FIELD_BYTES];
	void *iterator = NULL;
	int index = -1;

	while (yaml_next_item(yaml, value, &iterator, &index, &item, field) && index <= ACTOR_MAX)
		read_layout(yaml, &item, target);
	if (index < 0 && fy_node_is_sequence(value->node))
		yaml_complain(yaml, value->place, value->field, "no layout in the list");
}

static void read_hd(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	struct reading *reading = target;

	plan_read_hd(yaml, value, &reading->config.plan, &reading->plan);
}

static void read_calibration(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	calibration_read(yaml, value, &((struct config *)target)->calibration);
}

#define PLAN_MICROS(member, low) NUMBER(YAML_MICROS, plan.member, (low), 1e6, "microseconds")

enum key {
	KEY_RIG,
	KEY_LAYOUT,
	KEY_LAYOUTS,
	KEY_CAMERAS,
	KEY_TRIGGER,
	KEY_RATE,
	KEY_EXPOSURE,
	KEY_IR_DELAY,
	KEY_STROBE_DELAY,
	KEY_STROBE_WIDTH,
	KEY_STROBE_DUTY,
	KEY_HD,
	KEY_SOCKET_DIR,
	KEY_MASKS,
	KEY_BLOBS,
	KEY_TRACKING,
	KEY_SIM,
	KEY_CALIBRATION,
	KEY_STROBE_ONE_SHOT,
	KEY_STROBE_PULL_DOWN,
	KEY_RECORDINGS_DIR,
	KEY_COUNT
};

static const struct yaml_key keys[KEY_COUNT + 1] = {
	[KEY_RIG] = {"rig", YAML_TEXT, AT(rig_dir), true, .size = PATH_MAX},
	[KEY_LAYOUT] = {"layout", YAML_CUSTOM, .read = read_layout},
	[KEY_LAYOUTS] = {"layouts", YAML_CUSTOM, .read = read_layouts},
	[KEY_CAMERAS] = {"cameras", YAML_CUSTOM, .required = true, .read = read_cameras},
	[KEY_TRIGGER] = {"trigger", YAML_TEXT, AT(trigger),
			 .size = sizeof(((struct config *)0)->trigger)},
	[KEY_RATE] = {"rate_hz", YAML_CUSTOM, .read = read_rate},
	[KEY_EXPOSURE] = {"exposure_us", PLAN_MICROS(ir_exposure_ns, 1)},
	[KEY_IR_DELAY] = {"ir_delay_us", PLAN_MICROS(ir_delay_ns, 0)},
	[KEY_STROBE_DELAY] = {"strobe_delay_us", PLAN_MICROS(strobe_delay_ns, 0)},
	[KEY_STROBE_WIDTH] = {"strobe_width_us", PLAN_MICROS(strobe_width_ns, 0)},
	[KEY_STROBE_DUTY] = {"strobe_duty_max", NUMBER(YAML_DOUBLE, plan.strobe_duty_max, 0.001, 1,
						       "share of the time")},
	[KEY_HD] = {"hd", YAML_CUSTOM, .read = read_hd},
	[KEY_SOCKET_DIR] = {"socket_dir", YAML_TEXT, AT(socket_dir), .size = PATH_MAX},
	[KEY_MASKS] = {"masks", YAML_TEXT, AT(masks_path), .size = PATH_MAX},
	[KEY_BLOBS] = {"blobs", YAML_CUSTOM, .read = read_blobs},
	[KEY_TRACKING] = {"tracking", YAML_CUSTOM, .read = read_tracking},
	[KEY_SIM] = {"sim", YAML_CUSTOM, .read = read_sim},
	[KEY_CALIBRATION] = {"calibration", YAML_CUSTOM, .read = read_calibration},
	[KEY_STROBE_ONE_SHOT] = {"strobe_one_shot_us",
				 NUMBER(YAML_MICROS, strobe_one_shot_ns, 1, 1e6, "microseconds")},
	[KEY_STROBE_PULL_DOWN] = {"strobe_pull_down", YAML_BOOL, .offset = AT(strobe_pull_down)},
	[KEY_RECORDINGS_DIR] = {"recordings_dir", YAML_TEXT, AT(recordings_dir), .size = PATH_MAX},
};

static void set_defaults(struct config *config, const char *path)
{
	char copy[PATH_MAX];

	snprintf(config->path, sizeof(config->path), "%s", path);
	snprintf(copy, sizeof(copy), "%s", path);
	snprintf(config->base_dir, sizeof(config->base_dir), "%s", dirname(copy));
	strcpy(config->socket_dir, "/run/stage");
	strcpy(config->trigger, "free");
	strcpy(config->sim_scene, "talking");
	config->blobs = blob_settings_default();
	config->tracking = tracker_settings_default();
	config->plan = plan_unset();
	config->calibration = calibration_default();
}

/* Makes a relative path start from the config file's directory. */
static void resolve(struct yaml *yaml, const struct config *config, char path[PATH_MAX],
		    struct yaml_place place, const char *field, size_t length_max)
{
	char joined[2 * PATH_MAX];

	if (*path == '/')
		snprintf(joined, sizeof(joined), "%s", path);
	else
		snprintf(joined, sizeof(joined), "%s/%s", config->base_dir, path);
	if (strlen(joined) > length_max)
		yaml_complain(yaml, place, field, "the path %.60s... is longer than %zu bytes",
			      joined, length_max);
	else
		memcpy(path, joined, strlen(joined) + 1);
}

static void resolve_layouts(struct yaml *yaml, struct config *config,
			    const struct yaml_place *places, const struct yaml_value *root)
{
	struct yaml_place one = places[KEY_LAYOUT], several = places[KEY_LAYOUTS];

	if (!one.line && !several.line && fy_node_is_mapping(root->node))
		yaml_complain(yaml, root->place, "layout", "missing");
	if (one.line && several.line)
		yaml_complain(yaml, several, "layouts",
			      "layout stands in line %d: write one of the two", one.line);
	for (uint32_t i = 0; i < config->layout_count; i++)
		resolve(yaml, config, config->layout_paths[i], one.line ? one : several, "layout",
			PATH_MAX - 1);
}

/* Of a scene: else it is a name. */
static bool is_path(const char *scene)
{
	size_t length = strlen(scene);

	return strchr(scene, '/') || (length > 5 && strcmp(scene + length - 5, ".yaml") == 0);
}

static void finish_plan(struct yaml *yaml, struct reading *reading, const struct yaml_place *places,
			struct yaml_place root)
{
	static const int key_of_field[] = {
		[PLAN_PERIOD] = KEY_RATE,
		[PLAN_IR_DELAY] = KEY_IR_DELAY,
		[PLAN_IR_EXPOSURE] = KEY_EXPOSURE,
		[PLAN_STROBE_DELAY] = KEY_STROBE_DELAY,
		[PLAN_STROBE_WIDTH] = KEY_STROBE_WIDTH,
		[PLAN_STROBE_DUTY] = KEY_STROBE_DUTY,
	};
	struct config *config = &reading->config;

	for (int f = 0; f < PLAN_HD_DIVIDER; f++)
		reading->plan.fields[f] = places[key_of_field[f]];
	reading->plan.otherwise = root;
	plan_finish(yaml, &config->plan, &reading->plan);
	for (uint32_t i = 0; i < config->camera_count; i++)
		camera_finish(yaml, config, i);
}

/* Real devices live in real time. */
static void check_clock(struct yaml *yaml, const struct config *config)
{
	struct yaml_place place = {config->sim_clock_line, config->sim_clock_column};

	if (config->sim_clock == SIM_CLOCK_REAL)
		return;
	for (uint32_t c = 0; c < config->camera_count; c++)
		if (strncmp(config->cameras[c].address, "sim:", 4) != 0)
			yaml_complain(yaml, place, "sim.clock",
				      "time cannot be virtual for camera %s, which is %.64s: "
				      "write real, or use sim: cameras alone",
				      config->cameras[c].name, config->cameras[c].address);
	if (strcmp(config->trigger, "sim") != 0)
		yaml_complain(yaml, place, "sim.clock",
			      "time cannot be virtual for the trigger, which is %s: write real, "
			      "or trigger: sim",
			      config->trigger);
}

/* Masks from their own file. */
static void add_masks(struct yaml *yaml, struct config *config, struct yaml_place place)
{
	static struct masks masks; /* control thread only */

	if (!*config->masks_path)
		return;
	resolve(yaml, config, config->masks_path, place, "masks", PATH_MAX - 1);
	if (masks_load(&masks, config->masks_path, yaml->diag) < 0) {
		yaml->failed = true;
		return;
	}
	for (uint32_t m = 0; m < masks.count; m++) {
		int found =
			camera_find(config->cameras, config->camera_count, masks.cameras[m].camera);
		struct config_camera *camera = found < 0 ? NULL : &config->cameras[found];

		if (!camera || camera->role != ROLE_IR)
			yaml_complain(yaml, place, "masks", "%s: there is no camera %s of role ir",
				      config->masks_path, masks.cameras[m].camera);
		else if (camera->mask.area_count)
			yaml_complain(yaml, (struct yaml_place){camera->line, camera->column},
				      "cameras",
				      "camera %s has a mask here and in %s: keep one of them",
				      camera->name, config->masks_path);
		else
			camera->mask = masks.cameras[m].mask;
	}
}

static void read_config(struct yaml *yaml, struct reading *reading,
			const struct config_drivers *drivers)
{
	struct config *config = &reading->config;
	struct yaml_value root = yaml_root(yaml);
	struct yaml_place places[KEY_COUNT + 1];

	memset(places, 0, sizeof(places));
	yaml_read_mapping(yaml, &root, keys, reading, places);
	check_clock(yaml, config);
	finish_plan(yaml, reading, places, root.place);
	struct yaml_place trigger = places[KEY_TRIGGER];

	plan_finish_calibration(
		yaml, config, places[KEY_CALIBRATION].line ? places[KEY_CALIBRATION] : root.place);
	if (drivers)
		addresses_ask(yaml, config, drivers, trigger.line ? trigger : root.place);
	sim_faults_finish(yaml, &config->sim_faults, config->cameras, config->camera_count);
	if (is_path(config->sim_scene))
		resolve(yaml, config, config->sim_scene, root.place, "sim.scene", PATH_MAX - 1);
	resolve(yaml, config, config->rig_dir, places[KEY_RIG], "rig", PATH_MAX - NAME_BYTES - 16);
	resolve_layouts(yaml, config, places, &root);
	add_masks(yaml, config, places[KEY_MASKS]);
	if (*config->recordings_dir)
		resolve(yaml, config, config->recordings_dir, places[KEY_RECORDINGS_DIR],
			"recordings_dir", PATH_MAX - 1);
	resolve(yaml, config, config->socket_dir, places[KEY_SOCKET_DIR], "socket_dir",
		108 - 1 - SOCKET_NAME_MAX);
}

struct blob_settings config_blobs(const struct config *config, uint32_t camera)
{
	struct blob_settings settings = config->blobs;

	if (config->cameras[camera].electrons_per_grey > 0)
		settings.electrons_per_grey = config->cameras[camera].electrons_per_grey;
	return settings;
}

int config_load_for(struct config *config, const char *path, const struct config_drivers *drivers,
		    struct diag *diag)
{
	static struct reading made; /* control thread only; too large for its stack */
	struct yaml yaml;
	int err;

	if (strlen(path) >= PATH_MAX) {
		diag_add(diag, "%.60s...: %s", path, strerror(ENAMETOOLONG));
		return -ENAMETOOLONG;
	}
	err = yaml_open(&yaml, path, CONFIG_SIZE_MAX, diag);
	if (err)
		return err;
	memset(&made, 0, sizeof(made));
	set_defaults(&made.config, path);
	read_config(&yaml, &made, drivers);
	err = yaml.failed ? -EINVAL : 0;
	yaml_close(&yaml);
	if (!err)
		*config = made.config;
	return err;
}

int config_load(struct config *config, const char *path, struct diag *diag)
{
	return config_load_for(config, path, NULL, diag);
}
