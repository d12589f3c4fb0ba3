/*
 * What libcamera does not know of a sensor: its shutter, its trigger input and its own controls.
 * The sensor is a sub-device of V4L2 beside libcamera, found by the place that is its id.
 */
#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/libcamera/libcamera_device.h"
#include "drivers/v4l2/v4l2_device.h"

#define SUBDEVICES "/sys/class/video4linux/v4l-subdev*"
#define FIRMWARE "/sys/firmware/devicetree"
#define TRIGGER "trigger_mode" /* what drivers call the control or the module's parameter */

static bool is_among(const char *model, const char *const *names)
{
	while (*names && strcmp(*names, model) != 0)
		names++;
	return *names;
}

enum camera_shutter libcamera_sensor_shutter(const char *model)
{
	static const char *const global[] = {
		"ar0134",  "ar0135", "ar0144", "ar0234", "imx296", "mt9v022", "mt9v024", "mt9v032",
		"mt9v034", "ov2311", "ov7251", "ov9281", "ov9282", "vd55g1",  "vd56g3",  NULL};
	static const char *const rolling[] = {
		"ar0330", "ar0521", "imx214", "imx219",  "imx258",  "imx274", "imx283",
		"imx290", "imx327", "imx335", "imx378",  "imx412",  "imx415", "imx462",
		"imx477", "imx519", "imx708", "mt9m111", "ov2640",  "ov2680", "ov2740",
		"ov5640", "ov5645", "ov5647", "ov5670",  "ov5675",  "ov5693", "ov7740",
		"ov8856", "ov8858", "ov8865", "ov13858", "ov64a40", NULL};

	return is_among(model, global)    ? SHUTTER_GLOBAL
	       : is_among(model, rolling) ? SHUTTER_ROLLING
					  : SHUTTER_UNKNOWN;
}

/* The first line of a file of a sub-device's; "" when there is none. */
static void read_line(const char *directory, const char *name, char *line, int size)
{
	char path[PATH_MAX + 64];
	FILE *file;

	snprintf(path, sizeof(path), "%s/%s", directory, name);
	file = fopen(path, "re");
	if (!file || !fgets(line, size, file))
		*line = '\0';
	if (file)
		fclose(file);
	line[strcspn(line, "\n")] = '\0';
}

/* Where a link of a sub-device's leads; "" when there is none. */
static void follow(const char *directory, const char *name, char target[PATH_MAX])
{
	char path[PATH_MAX + 64];

	snprintf(path, sizeof(path), "%s/%s", directory, name);
	if (!realpath(path, target))
		*target = '\0';
}

/* libcamera's ids are places in the device tree, in ACPI, or among the kernel's own devices. */
static bool has_id(const char *directory, const char *id)
{
	char place[PATH_MAX], path[PATH_MAX + 64], name[64];

	follow(directory, "device/of_node", place);
	if (strncmp(place, FIRMWARE, strlen(FIRMWARE)) == 0 &&
	    strcmp(place + strlen(FIRMWARE), id) == 0)
		return true;
	read_line(directory, "device/firmware_node/path", path, sizeof(path));
	if (*path && strcmp(path, id) == 0)
		return true;
	follow(directory, "device", place);
	read_line(directory, "name", name, sizeof(name));
	snprintf(path, sizeof(path), "%s %s", place, name);
	return strncmp(path, "/sys/devices/", 13) == 0 && strcmp(path + 13, id) == 0;
}

bool libcamera_find_sensor(const char *id, char *directory, size_t size)
{
	bool found = false;
	glob_t all;

	if (glob(SUBDEVICES, 0, NULL, &all))
		return false;
	for (size_t i = 0; i < all.gl_pathc && !found; i++)
		if (has_id(all.gl_pathv[i], id) && strlen(all.gl_pathv[i]) < size) {
			strcpy(directory, all.gl_pathv[i]);
			found = true;
		}
	globfree(&all);
	return found;
}

static int open_sensor(struct v4l2_device *sensor, const struct libcamera_at *at)
{
	char node[80];

	snprintf(node, sizeof(node), "/dev/%.60s", strrchr(at->sensor, '/') + 1);
	snprintf(sensor->address, sizeof(sensor->address), "%.120s (%.30s)", at->address, node);
	sensor->fd = open(node, O_RDWR | O_CLOEXEC);
	return sensor->fd < 0 ? -errno : 0;
}

/* By the sensor's control, where it has one. */
static bool switch_trigger(const struct v4l2_device *sensor, bool on)
{
	struct camera_mode one = {.control_count = 1,
				  .controls = {{.name = TRIGGER, .value = on ? 1 : 0}}};
	struct camera_mode taken = {0};
	struct diag unheard = {0};
	int error = v4l2_set_controls(sensor, &one, &taken, &unheard);

	diag_finish(&unheard);
	return !error && taken.controls[0].value == one.controls[0].value;
}

/* Some drivers have it as a parameter of their module, for all sensors at once. */
static int check_module(const struct libcamera_at *at, struct diag *diag)
{
	char module[PATH_MAX], value[16];

	follow(at->sensor, "device/driver/module", module);
	read_line(module, "parameters/" TRIGGER, value, sizeof(value));
	if (*value && strcmp(value, "0") != 0 && strcmp(value, "N") != 0)
		return 0;
	if (*value) {
		const char *name = strrchr(module, '/') + 1;

		diag_add(diag,
			 "%s: trigger: the sensor's driver is told to run free: write 'options "
			 "%s " TRIGGER
			 "=1' to /etc/modprobe.d/stage.conf and start the computer anew",
			 at->address, name);
	} else {
		diag_add(diag,
			 "%s: trigger: the driver of the sensor %s has no trigger input (neither a "
			 "control nor a module parameter " TRIGGER "): another sensor, or no line "
			 "to it in the trigger",
			 at->address, libcamera_shim_model(at->device));
	}
	return -ENOTSUP;
}

static int refuse(const struct libcamera_at *at, const struct camera_mode *wanted,
		  struct diag *diag)
{
	diag_add(diag,
		 "%s: %s: the camera's sensor is no sub-device of V4L2, whose settings could be "
		 "reached: take it out",
		 at->address, wanted->triggered ? "trigger" : "controls");
	return -ENOTSUP;
}

int libcamera_set_sensor(const struct libcamera_at *at, const struct camera_mode *wanted,
			 struct camera_mode *granted, struct diag *diag)
{
	struct v4l2_device sensor = {.fd = -1};
	bool wants = wanted->triggered || wanted->control_count;
	int error;

	if (!*at->sensor)
		return wants ? refuse(at, wanted, diag) : 0;
	error = open_sensor(&sensor, at);
	if (error)
		return wants ? v4l2_fail(&sensor, error, "open", diag) : 0;
	if (!switch_trigger(&sensor, wanted->triggered) && wanted->triggered)
		error = check_module(at, diag);
	if (!error)
		error = v4l2_set_controls(&sensor, wanted, granted, diag);
	if (!error)
		granted->row_time_ns = v4l2_row_time_ns(&sensor, granted->width_px);
	close(sensor.fd);
	return error;
}
