/*
 * The list of findings, and how a person or a program reads it.
 */
#include <inttypes.h>
#include <jansson.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "ctl/doctor/doctor.h"
#include "ctl/print_json.h"
#include "ctl/program_drivers.h"

static const char *const level_names[FINDING_LEVEL_COUNT] = {
	[FINDING_OK] = "ok",
	[FINDING_NOTE] = "note",
	[FINDING_PROBLEM] = "problem",
};

const char *finding_level_name(enum finding_level level)
{
	return level_names[level];
}

struct finding *doctor_find(struct doctor *doctor, enum finding_level level, const char *format,
			    ...)
{
	va_list arguments;

	if (doctor->finding_count < FINDING_MAX)
		doctor->finding_count++;
	struct finding *finding = &doctor->findings[doctor->finding_count - 1];

	*finding = (struct finding){.topic = doctor->topic, .level = level};
	va_start(arguments, format);
	vsnprintf(finding->what, sizeof(finding->what), format, arguments);
	va_end(arguments);
	return finding;
}

void doctor_say(char field[FINDING_BYTES], const char *format, ...)
{
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(field, FINDING_BYTES, format, arguments);
	va_end(arguments);
}

uint32_t doctor_count(const struct doctor *doctor, enum finding_level level)
{
	uint32_t count = 0;

	for (uint32_t f = 0; f < doctor->finding_count; f++)
		count += doctor->findings[f].level == level;
	return count;
}

static void print_finding(const struct finding *finding)
{
	printf("  %-8s %s: %s", level_names[finding->level], finding->what, finding->measured);
	if (*finding->limit)
		printf(" (%s)", finding->limit);
	if (*finding->remedy)
		printf("; %s", finding->remedy);
	putchar('\n');
}

void doctor_print(const struct doctor *doctor)
{
	const char *topic = NULL;

	for (uint32_t f = 0; f < doctor->finding_count; f++) {
		const struct finding *finding = &doctor->findings[f];

		if (finding->topic != topic)
			printf("%s\n", finding->topic);
		topic = finding->topic;
		print_finding(finding);
	}
	unsigned problems = doctor_count(doctor, FINDING_PROBLEM);
	unsigned notes = doctor_count(doctor, FINDING_NOTE);
	printf("%u problem%s, %u note%s, %u ok\n", problems, problems == 1 ? "" : "s", notes,
	       notes == 1 ? "" : "s", doctor_count(doctor, FINDING_OK));
}

void doctor_print_json(const struct doctor *doctor)
{
	json_t *findings = json_array();

	for (uint32_t f = 0; f < doctor->finding_count; f++) {
		const struct finding *finding = &doctor->findings[f];

		json_array_append_new(
			findings, json_pack("{s:s, s:s, s:s, s:s, s:s, s:s}", "topic",
					    finding->topic, "level", level_names[finding->level],
					    "what", finding->what, "measured", finding->measured,
					    "limit", finding->limit, "remedy", finding->remedy));
	}
	print_json(json_pack("{s:o, s:I, s:I, s:I}", "findings", findings, "problems",
			     (json_int_t)doctor_count(doctor, FINDING_PROBLEM), "notes",
			     (json_int_t)doctor_count(doctor, FINDING_NOTE), "ok",
			     (json_int_t)doctor_count(doctor, FINDING_OK)));
}

static bool has_driver(const char *address, const char *driver)
{
	size_t length = strlen(driver);

	return strncmp(address, driver, length) == 0 &&
	       (address[length] == ':' || address[length] == '\0');
}

bool doctor_uses(const struct doctor *doctor, const char *driver)
{
	const struct config *config = doctor->config;

	if (!config)
		return false;
	for (uint32_t c = 0; c < config->camera_count; c++)
		if (has_driver(config->cameras[c].address, driver))
			return true;
	return has_driver(config->trigger, driver);
}

const struct trigger_driver *doctor_trigger(const struct doctor *doctor, const char **rest)
{
	struct diag unread = {0};

	if (!doctor->config)
		return NULL;
	const struct trigger_driver *driver =
		trigger_driver_find(live_triggers, doctor->config->trigger, rest, &unread);

	diag_finish(&unread);
	return driver;
}
