/*
 * stagectl calibrate list, show, rollback: the revisions of a rig.
 */
#include <errno.h>
#include <jansson.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "base/file.h"
#include "calib/rig_store.h"
#include "config/config.h"
#include "ctl/arguments.h"
#include "ctl/print_json.h"

#define FACTS_SIZE_MAX (1 << 20)
#define VALUE_BYTES 64

struct asked {
	char rig_dir[PATH_MAX];
	uint64_t number;
	bool json;
};

struct revision {
	uint32_t number;
	bool in_force;
	/* "" where rig.yaml does not say */
	char revision[VALUE_BYTES], passed[VALUE_BYTES], rms_px[VALUE_BYTES];
	char made_by[VALUE_BYTES], made_from[VALUE_BYTES];
	char held_out_px[VALUE_BYTES], worst_mm[VALUE_BYTES], poses[VALUE_BYTES];
};

/* A config's rig, or the rig itself. */
static int find_rig(struct asked *asked, const char *path, struct diag *diag)
{
	struct config *config;
	size_t length = strlen(path);

	if (length < 5 || strcmp(path + length - 5, ".yaml")) {
		if (length >= RIG_STORE_PATH) {
			diag_add(diag, "%.60s...: path too long", path);
			return -ENAMETOOLONG;
		}
		strcpy(asked->rig_dir, path);
		return 0;
	}
	config = calloc(1, sizeof(*config));
	if (!config)
		return -ENOMEM;
	int err = config_load(config, path, diag);
	if (!err)
		memcpy(asked->rig_dir, config->rig_dir, sizeof(asked->rig_dir));
	free(config);
	return err;
}

static char *read_facts(const char *rig_dir, uint32_t number, struct diag *diag)
{
	char path[PATH_MAX], *text;
	size_t length, size;

	if (rig_store_revision_path(path, rig_dir, number, diag))
		return NULL;
	length = strlen(path);
	snprintf(path + length, sizeof(path) - length, "/rig.yaml");
	return file_read(&text, &size, path, FACTS_SIZE_MAX, diag) ? NULL : text;
}

/* The value of a key at a line's beginning, without quotes and remark. */
static void take_value(const char *text, const char *key, char value[VALUE_BYTES])
{
	size_t length = strlen(key);

	value[0] = '\0';
	for (const char *line = text; line && *line; line = strchr(line, '\n')) {
		line += *line == '\n';
		const char *at = line + strspn(line, " ");
		if (strncmp(at, key, length) || at[length] != ':')
			continue;
		at += length + 1;
		at += strspn(at, " \"");
		snprintf(value, VALUE_BYTES, "%.*s", (int)strcspn(at, "\" #\n"), at);
		return;
	}
}

static void take_revision(struct revision *revision, const char *rig_dir, uint32_t number)
{
	char *text = read_facts(rig_dir, number, NULL);

	memset(revision, 0, sizeof(*revision));
	revision->number = number;
	revision->in_force = rig_store_in_force(rig_dir) == number;
	if (!text)
		return; /* a rig that was not calibrated here */
	take_value(text, "revision", revision->revision);
	take_value(text, "passed", revision->passed);
	take_value(text, "made_by", revision->made_by);
	take_value(text, "made_from", revision->made_from);
	take_value(text, "rms_px", revision->rms_px);
	take_value(text, "held_out_rms_px", revision->held_out_px);
	take_value(text, "worst_mm", revision->worst_mm);
	take_value(text, "poses", revision->poses);
	free(text);
}

static json_t *revision_json(const struct revision *r)
{
	json_t *object = json_pack("{s:i, s:b}", "number", (int)r->number, "in_force", r->in_force);

	if (*r->revision)
		json_object_set_new(object, "revision", json_string(r->revision));
	if (*r->passed)
		json_object_set_new(object, "passed", json_boolean(!strcmp(r->passed, "true")));
	if (*r->poses)
		json_object_set_new(object, "poses", json_integer(strtol(r->poses, NULL, 10)));
	if (*r->made_by)
		json_object_set_new(object, "made_by", json_string(r->made_by));
	if (*r->rms_px)
		json_object_set_new(object, "rms_px", json_real(strtod(r->rms_px, NULL)));
	if (*r->held_out_px)
		json_object_set_new(object, "held_out_px", json_real(strtod(r->held_out_px, NULL)));
	if (*r->worst_mm)
		json_object_set_new(object, "worst_mm", json_real(strtod(r->worst_mm, NULL)));
	return object;
}

static void print_revision(const struct revision *r)
{
	if (!*r->revision)
		printf("%c %04u  from before, or made elsewhere\n", r->in_force ? '*' : ' ',
		       r->number);
	else if (*r->made_by)
		printf("%c %04u  %s  %s of %s\n", r->in_force ? '*' : ' ', r->number, r->revision,
		       r->made_by, *r->made_from ? r->made_from : "a rig from before");
	else
		printf("%c %04u  %s  rms %s px, held out %s px, worst %s mm, %s poses%s\n",
		       r->in_force ? '*' : ' ', r->number, r->revision, r->rms_px, r->held_out_px,
		       r->worst_mm, r->poses, strcmp(r->passed, "false") ? "" : ", FAILED");
}

static int list(const struct asked *asked, struct diag *diag)
{
	uint32_t *numbers = calloc(RIG_REVISION_MAX, sizeof(*numbers));
	json_t *all = json_array();
	int count = numbers ? rig_store_list(asked->rig_dir, numbers, diag) : -ENOMEM;

	for (int i = 0; i < count; i++) {
		struct revision revision;

		take_revision(&revision, asked->rig_dir, numbers[i]);
		if (asked->json)
			json_array_append_new(all, revision_json(&revision));
		else
			print_revision(&revision);
	}
	if (count >= 0 && asked->json) {
		print_json(json_incref(all));
	} else if (count == 0) {
		printf("%s has no revisions yet\n", asked->rig_dir);
	}
	json_decref(all);
	free(numbers);
	return count < 0 ? count : 0;
}

static int show(const struct asked *asked, struct diag *diag)
{
	uint32_t number =
		asked->number ? (uint32_t)asked->number : rig_store_in_force(asked->rig_dir);
	struct revision revision;

	if (!number || asked->number > RIG_REVISION_MAX) {
		diag_add(diag, "%s: no such revision; stagectl calibrate list tells them",
			 asked->rig_dir);
		return -EINVAL;
	}
	take_revision(&revision, asked->rig_dir, number);
	if (asked->json) {
		print_json(revision_json(&revision));
		return 0;
	}
	char *text = read_facts(asked->rig_dir, number, diag);
	if (!text)
		return -EINVAL;
	printf("# %s, %04u%s\n%s", asked->rig_dir, number, revision.in_force ? ", in force" : "",
	       text);
	free(text);
	return 0;
}

/* The last one before the present that has not failed. */
static uint32_t find_earlier(const struct asked *asked, struct diag *diag)
{
	uint32_t *numbers = calloc(RIG_REVISION_MAX, sizeof(*numbers));
	uint32_t present = rig_store_in_force(asked->rig_dir), found = 0;
	int count = numbers ? rig_store_list(asked->rig_dir, numbers, diag) : 0;
	struct revision revision;

	for (int i = 0; i < count && numbers[i] < present; i++) {
		take_revision(&revision, asked->rig_dir, numbers[i]);
		if (strcmp(revision.passed, "false"))
			found = numbers[i];
	}
	free(numbers);
	return found;
}

static int rollback(const struct asked *asked, struct diag *diag)
{
	uint32_t number = asked->number <= RIG_REVISION_MAX ? (uint32_t)asked->number : 0;
	struct revision revision;
	uint32_t kept;

	if (!asked->number)
		number = find_earlier(asked, diag);
	if (!number) {
		diag_add(diag, "%s: no earlier revision; stagectl calibrate list tells them",
			 asked->rig_dir);
		return -EINVAL;
	}
	take_revision(&revision, asked->rig_dir, number);
	if (!strcmp(revision.passed, "false")) {
		diag_add(diag, "%s: revision %04u has failed its limits and cannot come into force",
			 asked->rig_dir, number);
		return -EINVAL;
	}
	int err = rig_store_put_in_force(asked->rig_dir, number, &kept, diag);
	if (err)
		return err;
	if (asked->json)
		printf("{\"number\":%u}\n", number);
	else
		printf("%s: revision %04u is in force; a running station takes it with stagectl "
		       "rig "
		       "reload\n",
		       asked->rig_dir, number);
	return 0;
}

static int run(const struct verb *verb, int argc, char **argv,
	       int (*act)(const struct asked *asked, struct diag *diag), bool with_number)
{
	struct asked asked = {0};
	struct diag diag = {0};
	const char *path;
	const struct argument arguments[] = {
		{"json", NULL, "print JSON", .flag = &asked.json},
		{with_number ? "revision" : NULL, "N", "which one (default: see calibrate list)",
		 .count = &asked.number},
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, &path, 1);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	int err = find_rig(&asked, path, &diag);
	if (!err)
		err = act(&asked, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

int verb_calibrate_list(const struct verb *verb, int argc, char **argv)
{
	return run(verb, argc, argv, list, false);
}

int verb_calibrate_show(const struct verb *verb, int argc, char **argv)
{
	return run(verb, argc, argv, show, true);
}

int verb_calibrate_rollback(const struct verb *verb, int argc, char **argv)
{
	return run(verb, argc, argv, rollback, true);
}
