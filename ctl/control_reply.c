/*
 * One error after the other, each with its remedy and exit code.
 */
#include "ctl/control_reply.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/exit_codes.h"

/* Length of the JSON escape at `at` of a character that a terminal obeys; 0: another one. */
static size_t control_escape(const char *at)
{
	if (at[0] != '\\')
		return 0;
	if (at[1] != 'u')
		return at[1] && strchr("bfnrt", at[1]) ? 2 : 0;
	if (strncmp(at + 2, "00", 2) != 0 || !at[4] || !at[5])
		return 0;
	return strchr("01", at[4]) || strchr("89", at[4]) || strncasecmp(at + 4, "7f", 2) == 0 ? 6
											       : 0;
}

/* The same JSON with these escapes as plain text; NULL without memory. DEL and the C1 set, which
 * JSON lets through, become question marks. */
static char *make_printable(const char *text)
{
	size_t size = strlen(text);
	char *out = malloc(size + size / 2 + 1), *to = out;

	for (const char *from = text; out && *from;) {
		size_t escape = control_escape(from), length = escape ? escape : 1;
		bool c1 = from[0] == '\xc2' && (from[1] & 0xe0) == 0x80;

		if (escape)
			*to++ = '\\';
		else if (from[0] == '\\' && from[1])
			length = 2;
		memcpy(to, from, length);
		if (c1 || from[0] == 0x7f)
			*to = '?';
		to += length;
		from += c1 ? 2 : length;
	}
	if (out)
		*to = '\0';
	return out;
}

static const char *text_of(const json_t *parameters, const char *key)
{
	const char *text = json_string_value(json_object_get(parameters, key));

	return text ? text : "?";
}

/* Prints what the station says, and returns the exit code that it names. */
static int report_failed(const json_t *parameters)
{
	json_t *messages = json_object_get(parameters, "messages");
	json_int_t code = json_integer_value(json_object_get(parameters, "exit_code"));
	size_t index;
	json_t *message;

	json_array_foreach(messages, index, message)
		fprintf(stderr, "stagectl: %s\n",
			json_is_string(message) ? json_string_value(message) : "?");
	if (json_array_size(messages) == 0)
		fputs("stagectl: the station failed, and its log says why\n", stderr);
	return code > EXIT_CODE_OK && code <= EXIT_CODE_PERMISSION ? (int)code : EXIT_CODE_INTERNAL;
}

static int report_wrong_state(const json_t *parameters)
{
	const char *state = text_of(parameters, "state");
	const char *remedy = strcmp(state, "configured") == 0 ? "nothing runs"
			     : strcmp(state, "calibrating") == 0
				     ? "wait for who calibrates, or stagectl stop"
				     : "stagectl stop first";

	fprintf(stderr, "stagectl: the station is %s: this cannot be done now; %s\n", state,
		remedy);
	return EXIT_CODE_RUNNING;
}

static int report_busy(const json_t *parameters)
{
	(void)parameters;
	fputs("stagectl: the change before is not yet in use: try again in a moment\n", stderr);
	return EXIT_CODE_RUNNING;
}

static int report_too_many(const json_t *parameters)
{
	fprintf(stderr,
		"stagectl: the station serves no more than %d of these at once: end one of them, "
		"such as a stagectl status --follow\n",
		(int)json_integer_value(json_object_get(parameters, "limit")));
	return EXIT_CODE_RUNNING;
}

static int report_no_shot(const json_t *parameters)
{
	(void)parameters;
	fputs("stagectl: the station solved no shot in time: stagectl status says why\n", stderr);
	return EXIT_CODE_DEVICE;
}

static int report_no_frame(const json_t *parameters)
{
	fprintf(stderr, "stagectl: camera %s: no image came in time; it is %s\n",
		text_of(parameters, "camera"), text_of(parameters, "state"));
	return EXIT_CODE_DEVICE;
}

static int report_no_such_camera(const json_t *parameters)
{
	const json_t *cameras = json_object_get(parameters, "cameras");
	size_t index;
	json_t *name;

	fprintf(stderr, "stagectl: the station has no camera %s, but",
		text_of(parameters, "camera"));
	json_array_foreach((json_t *)cameras, index, name)
		fprintf(stderr, "%s %s", index ? "," : "",
			json_is_string(name) ? json_string_value(name) : "?");
	fputs(json_array_size(cameras) ? "\n" : " none\n", stderr);
	return EXIT_CODE_DEVICE;
}

/* To look is the first step of commands too: whoever may not even look needs both groups. */
static int report_denied(const json_t *parameters)
{
	const char *group = text_of(parameters, "group");

	fprintf(stderr,
		"stagectl: not permitted: it takes the group %s%s; add yourself to it and log in "
		"again\n",
		group,
		strcmp(group, "stage") == 0 ? ", and stage-operator for whoever commands" : "");
	return EXIT_CODE_PERMISSION;
}

static const struct {
	const char *error;
	int (*report)(const json_t *parameters);
} errors[] = {
	{"org.stage.Control.Failed", report_failed},
	{"org.stage.Control.WrongState", report_wrong_state},
	{"org.stage.Control.Busy", report_busy},
	{"org.stage.Control.TooMany", report_too_many},
	{"org.stage.Control.NoShot", report_no_shot},
	{"org.stage.Control.NoFrame", report_no_frame},
	{"org.stage.Control.NoSuchCamera", report_no_such_camera},
	{"org.stage.Control.PermissionDenied", report_denied},
};

static int report_error(const char *error, const json_t *parameters)
{
	for (size_t e = 0; e < sizeof(errors) / sizeof(errors[0]); e++)
		if (strcmp(error, errors[e].error) == 0)
			return errors[e].report(parameters);
	char *details = json_dumps(parameters, JSON_COMPACT);

	fprintf(stderr, "stagectl: the station refused: %s %s\n", error, details ? details : "");
	free(details);
	return EXIT_CODE_DEVICE;
}

static int report_stranger(const char *why)
{
	fprintf(stderr, "stagectl: what answers is no station: %s\n", why);
	return EXIT_CODE_CONNECTION;
}

int control_reply_unpack(json_t **out, bool *continues, const char *text)
{
	char *printable = make_printable(text);
	json_t *reply = printable ? json_loads(printable, 0, NULL) : NULL;
	const char *error = json_string_value(json_object_get(reply, "error"));
	json_t *parameters = json_object_get(reply, "parameters");
	int code = EXIT_CODE_OK;

	if (error) {
		code = report_error(error, parameters);
	} else if (!json_is_object(parameters)) {
		code = report_stranger("it sends no JSON reply");
	} else {
		*continues = json_is_true(json_object_get(reply, "continues"));
		*out = json_incref(parameters);
	}
	json_decref(reply);
	free(printable);
	return code;
}

const char *control_reply_text(const json_t *reply, const char *key)
{
	const char *text = json_string_value(json_object_get(reply, key));
	char why[64];

	if (!text) {
		snprintf(why, sizeof(why), "its reply has no %s", key);
		report_stranger(why);
	}
	return text;
}
