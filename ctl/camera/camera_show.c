/*
 * stagectl camera show: what a camera is and does. An address is opened; a name is asked of the
 * running station.
 */
#include <jansson.h>
#include <stdio.h>

#include "base/exit_codes.h"
#include "ctl/arguments.h"
#include "ctl/camera/camera_status.h"
#include "ctl/camera/snapshot.h"
#include "ctl/print_json.h"
#include "ctl/program_drivers.h"

static json_t *mode_json(const char *address, const struct camera_mode *mode)
{
	return json_pack("{s:s, s:i, s:i, s:s, s:f, s:I, s:f, s:b}", "address", address, "width_px",
			 mode->width_px, "height_px", mode->height_px, "format",
			 pixel_format_name(mode->format), "rate_hz",
			 mode->period_ns > 0 ? 1e9 / (double)mode->period_ns : 0.0, "exposure_ns",
			 (json_int_t)mode->exposure_ns, "gain_db", mode->gain_db, "triggered",
			 mode->triggered);
}

/* Opens and configures, takes no image. */
static int ask_device(json_t **out, const char *address)
{
	struct camera_mode granted;
	struct diag diag = {0};
	struct camera *camera;
	const char *rest;
	const struct camera_driver *driver =
		camera_driver_find(live_drivers, address, &rest, &diag);
	int code = driver ? EXIT_CODE_OK : EXIT_CODE_USAGE;

	if (driver) {
		int err = driver->open(&camera, rest, NULL, &diag);

		if (!err) {
			err = snapshot_configure(driver, camera, &granted, &diag);
			driver->close(camera);
		}
		code = exit_code_of(err, EXIT_CODE_DEVICE);
	}
	diag_print(&diag, stderr);
	diag_finish(&diag);
	if (code == EXIT_CODE_OK)
		*out = mode_json(address, &granted);
	return code;
}

/* Texts, as a rule. */
static void print_list(const json_t *list)
{
	size_t index;
	json_t *item;

	json_array_foreach((json_t *)list, index, item) printf(
		"%s%s", index ? ", " : "", json_is_string(item) ? json_string_value(item) : "...");
	puts(json_array_size(list) ? "" : "-");
}

static void print_values(const json_t *object, int indent)
{
	const char *key;
	json_t *value;

	json_object_foreach((json_t *)object, key, value)
	{
		printf("%*s%-*s ", indent, "", 16 - indent, key);
		if (json_is_object(value)) {
			putchar('\n');
			print_values(value, indent + 2);
			continue;
		}
		if (json_is_array(value))
			print_list(value);
		else if (json_is_string(value))
			puts(json_string_value(value));
		else if (json_is_null(value))
			puts("-");
		else if (json_is_boolean(value))
			puts(json_is_true(value) ? "yes" : "no");
		else if (json_is_integer(value))
			printf("%lld\n", (long long)json_integer_value(value));
		else
			printf("%.3f\n", json_number_value(value));
	}
}

int verb_camera_show(const struct verb *verb, int argc, char **argv)
{
	const char *camera, *socket_dir = DEFAULT_SOCKET_DIR;
	bool json = false;
	json_t *shown;
	const struct argument arguments[] = {
		ARGUMENT_SOCKET_DIR(&socket_dir),
		ARGUMENT_JSON(&json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &camera, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	int code = snapshot_is_address(camera) ? ask_device(&shown, camera)
					       : camera_status(&shown, socket_dir, camera);
	if (code)
		return code;
	if (json) {
		print_json(shown);
	} else {
		print_values(shown, 0);
		json_decref(shown);
	}
	return EXIT_CODE_OK;
}
