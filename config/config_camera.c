/*
 * The keys of one camera.
 */
#include "config/config_camera.h"

#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "config/masks.h"

static const char *const roles[] = {"ir", "hd", NULL};
static const char *const clocks[] = {"device", "ptp", NULL};
static const char *const receives[] = {"socket", "packets", NULL};
static const char *const shutters[] = {"unknown", "global", "rolling", NULL};

#define CAMERA_AT(member) offsetof(struct config_camera, member)

static void read_mask(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	mask_read(yaml, value, &((struct config_camera *)target)->mask);
}

static void read_format(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	static const struct yaml_key text = {"format", YAML_TEXT, .size = 16};
	struct config_camera *camera = target;
	char name[16] = "", known[160] = "";

	yaml_read_scalar(yaml, value, &text, name);
	if (!*name)
		return;
	camera->has_format = pixel_format_by_name(&camera->wanted.format, name) == 0;
	if (camera->has_format)
		return;
	for (int f = 0; f < PIXEL_FORMAT_COUNT; f++)
		snprintf(known + strlen(known), sizeof(known) - strlen(known), "%s%s",
			 f ? ", " : "", pixel_format_name((enum pixel_format)f));
	yaml_complain(yaml, value->place, value->field, "'%s' is none of %s", name, known);
}

static void read_controls(struct yaml *yaml, const struct yaml_value *value, void *target)
{
	static const struct yaml_key number = {"controls", YAML_INT, .min = INT32_MIN,
					       .max = INT32_MAX};
	struct camera_mode *mode = &((struct config_camera *)target)->wanted;
	struct camera_control control;
	char field[YAML_FIELD_BYTES];
	struct yaml_value item;
	void *iterator = NULL;

	while (yaml_next_pair(yaml, value, &iterator, control.name, sizeof(control.name), &item,
			      field)) {
		int number_read = 0;

		for (int c = 0; c < mode->control_count; c++)
			if (strcmp(mode->controls[c].name, control.name) == 0)
				yaml_complain(yaml, item.place, field, "given twice");
		if (mode->control_count == CAMERA_CONTROL_MAX) {
			yaml_complain(yaml, item.place, value->field, "more than %d controls",
				      CAMERA_CONTROL_MAX);
			return;
		}
		yaml_read_scalar(yaml, &item, &number, &number_read);
		control.value = number_read;
		mode->controls[mode->control_count++] = control;
	}
}

static const struct yaml_key camera_keys[] = {
	{"name", YAML_NAME, CAMERA_AT(name), true, .size = NAME_BYTES},
	{"address", YAML_TEXT, CAMERA_AT(address), true,
	 .size = sizeof(((struct config_camera *)0)->address)},
	{"role", YAML_CHOICE, CAMERA_AT(role), .choices = roles},
	{"width", YAML_INT, CAMERA_AT(wanted.width_px), .min = 32, .max = 16384, .unit = "pixels"},
	{"height", YAML_INT, CAMERA_AT(wanted.height_px), .min = 32, .max = 16384,
	 .unit = "pixels"},
	{"exposure_us", YAML_MICROS, CAMERA_AT(wanted.exposure_ns), .min = 1, .max = 1e6,
	 .unit = "microseconds"},
	{"gain_db", YAML_DOUBLE, CAMERA_AT(wanted.gain_db), .min = 0, .max = 60,
	 .unit = "decibels"},
	{"format", YAML_CUSTOM, .read = read_format},
	{"bits", YAML_INT, CAMERA_AT(wanted.bits), .min = 9, .max = 16, .unit = "bits"},
	{"readout_us", YAML_MICROS, CAMERA_AT(wanted.readout_ns), .min = 1, .max = 1e6,
	 .unit = "microseconds"},
	{"shutter", YAML_CHOICE, CAMERA_AT(wanted.shutter), .choices = shutters},
	{"row_time_us", YAML_MICROS, CAMERA_AT(wanted.row_time_ns), .min = 0.1, .max = 1000,
	 .unit = "microseconds"},
	{"clock", YAML_CHOICE, CAMERA_AT(wanted.clock), .choices = clocks},
	{"receive", YAML_CHOICE, CAMERA_AT(wanted.receive), .choices = receives},
	{"controls", YAML_CUSTOM, .read = read_controls},
	{"mask", YAML_CUSTOM, .read = read_mask},
	{"electrons_per_grey", YAML_DOUBLE, CAMERA_AT(electrons_per_grey), .min = 0.01, .max = 1e5},
	{0},
};

enum { CAMERA_NAME, CAMERA_ADDRESS, CAMERA_KEYS_SEEN = sizeof(camera_keys) / sizeof(*camera_keys) };

/* driver:rest, with a driver of small letters and digits. */
static void check_address(struct yaml *yaml, const struct config_camera *camera,
			  struct yaml_place place, const char *field)
{
	size_t driver = strspn(camera->address, "abcdefghijklmnopqrstuvwxyz0123456789");

	if (driver > 0 && camera->address[driver] == ':' && camera->address[driver + 1])
		return;
	yaml_complain(yaml, place, field,
		      "'%.64s' is not driver:device, for example aravis:192.168.1.7",
		      camera->address);
}

static void check_doubled(struct yaml *yaml, const struct config *config,
			  const struct config_camera *camera, const struct yaml_place *places,
			  const char *field)
{
	char part[YAML_FIELD_BYTES + 16];

	for (uint32_t i = 0; i < config->camera_count; i++) {
		const struct config_camera *other = &config->cameras[i];

		if (*camera->name && strcmp(camera->name, other->name) == 0) {
			snprintf(part, sizeof(part), "%s.name", field);
			yaml_complain(yaml, places[CAMERA_NAME], part,
				      "'%s' is already the camera of line %d", camera->name,
				      other->line);
		}
		if (*camera->address && strcmp(camera->address, other->address) == 0) {
			snprintf(part, sizeof(part), "%s.address", field);
			yaml_complain(yaml, places[CAMERA_ADDRESS], part,
				      "'%.64s' is already the address of the camera of line %d",
				      camera->address, other->line);
		}
	}
}

/* Spots are found in grey; HD pictures are kept as they are, in 8 bits a colour. */
static void check_format(struct yaml *yaml, struct config_camera *camera,
			 const struct yaml_value *value)
{
	enum pixel_format format = camera->wanted.format;
	bool is_grey = format == PIXEL_GREY8 || format == PIXEL_GREY16;

	if (!camera->has_format)
		camera->wanted.format = camera->role == ROLE_HD ? PIXEL_BAYER_RG8 : PIXEL_GREY8;
	else if (camera->role == ROLE_IR && !is_grey)
		yaml_complain(yaml, value->place, value->field,
			      "format: %s is for the role hd; a camera with the role ir gives grey "
			      "or grey16",
			      pixel_format_name(format));
	else if (camera->role == ROLE_HD && format == PIXEL_GREY16)
		yaml_complain(yaml, value->place, value->field,
			      "format: grey16 is for the role ir");
}

/* One that is tracked must have all rows open together; what it has, its driver may know better. */
static void check_shutter(struct yaml *yaml, struct config_camera *camera,
			  const struct yaml_value *value)
{
	enum camera_shutter *shutter = &camera->wanted.shutter;

	if (camera->wanted.row_time_ns && *shutter == SHUTTER_GLOBAL)
		yaml_complain(yaml, value->place, value->field,
			      "row_time_us: rows of a global shutter are open together: write "
			      "shutter: rolling, or take it out");
	if (camera->wanted.row_time_ns)
		*shutter = SHUTTER_ROLLING;
	else if (*shutter == SHUTTER_UNKNOWN && camera->role == ROLE_IR)
		*shutter = SHUTTER_GLOBAL;
}

void camera_read(struct yaml *yaml, const struct yaml_value *value, struct config *config)
{
	struct yaml_place places[CAMERA_KEYS_SEEN];
	struct config_camera camera = {.line = value->place.line, .column = value->place.column};
	char part[YAML_FIELD_BYTES + 16];

	memset(places, 0, sizeof(places));
	yaml_read_mapping(yaml, value, camera_keys, &camera, places);
	snprintf(part, sizeof(part), "%s.address", value->field);
	if (*camera.address)
		check_address(yaml, &camera, places[CAMERA_ADDRESS], part);
	check_doubled(yaml, config, &camera, places, value->field);
	if (camera.role == ROLE_HD && camera.mask.area_count)
		yaml_complain(
			yaml, value->place, value->field,
			"mask: only of a camera with the role ir, in whose images spots are found");
	check_format(yaml, &camera, value);
	check_shutter(yaml, &camera, value);
	config->cameras[config->camera_count++] = camera;
}

void camera_finish(struct yaml *yaml, struct config *config, uint32_t index)
{
	struct config_camera *camera = &config->cameras[index];
	struct yaml_place place = {camera->line, camera->column};
	struct camera_mode *wanted = &camera->wanted;
	char field[YAML_FIELD_BYTES];

	wanted->period_ns =
		config->plan.period_ns * (camera->role == ROLE_HD ? config->plan.hd_divider : 1);
	if (wanted->exposure_ns < wanted->period_ns || wanted->period_ns <= 0)
		return;
	snprintf(field, sizeof(field), "cameras[%u].exposure_us", index);
	yaml_complain(yaml, place, field,
		      "%.6g us does not fit between two pictures, which are %.6g us apart; lower "
		      "it or the rate",
		      (double)wanted->exposure_ns / NS_PER_US,
		      (double)wanted->period_ns / NS_PER_US);
}

int camera_find(const struct config_camera *cameras, uint32_t count, const char *name)
{
	for (uint32_t c = 0; c < count; c++)
		if (strcmp(cameras[c].name, name) == 0)
			return (int)c;
	return -ENOENT;
}
