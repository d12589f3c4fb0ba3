/*
 * stagectl calibrate list, show, rollback: the revisions of a rig.
 */
#include <errno.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/exit_codes.h"
#include "base/file.h"
#include "calib/rig/rig_store.h"
#include "config/config.h"
#include "config/rig_worth.h"
#include "ctl/arguments.h"
#include "ctl/print_json.h"

#define FACTS_SIZE_MAX (1 << 20)

struct asked {
	char rig_dir[PATH_MAX];
	uint64_t number;
	bool json;
};

struct revision {
	uint32_t number;
	bool in_force, has_worth;
	struct rig_worth worth;
};

/* A rig that was named itself, or its revisions; that of a config may not have been made yet. */
static int check_there(const char *rig_dir, struct diag *diag)
{
	char store[PATH_MAX];
	int err = rig_store_path(store, rig_dir, NULL, false, diag);

	if (err || access(rig_dir, F_OK) == 0 || access(store, F_OK) == 0)
		return err;
	diag_add(diag, "%s: no such rig: %s", rig_dir, strerror(ENOENT));
	return -ENOENT;
}

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
		return check_there(path, diag);
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

static int facts_path(char path[PATH_MAX], const char *rig_dir, uint32_t number, struct diag *diag)
{
	int err = rig_store_revision_path(path, rig_dir, number, diag);
	size_t length = err ? 0 : strlen(path);

	if (!err &&
	    snprintf(path + length, PATH_MAX - length, "/rig.yaml") >= (int)(PATH_MAX - length))
		err = -ENAMETOOLONG;
	return err;
}

static int check_revision(const char *rig_dir, uint32_t number, struct diag *diag)
{
	char path[PATH_MAX];
	int err = rig_store_revision_path(path, rig_dir, number, diag);

	if (err || access(path, F_OK) == 0)
		return err;
	diag_add(diag, "%s: no revision %04u; stagectl calibrate list tells them", rig_dir, number);
	return -ENOENT;
}

/* A rig that was not calibrated here has nothing to say of its worth. */
static int take_revision(struct revision *revision, const char *rig_dir, uint32_t number,
			 struct diag *diag)
{
	char path[PATH_MAX];
	int err = facts_path(path, rig_dir, number, diag);

	*revision = (struct revision){.number = number,
				      .in_force = rig_store_in_force(rig_dir) == number};
	if (err || access(path, F_OK))
		return err;
	err = rig_worth_load(&revision->worth, path, diag);
	revision->has_worth = !err;
	return err;
}

static void put_number(json_t *object, const char *key, double value)
{
	if (!isnan(value))
		json_object_set_new(object, key, json_real(value));
}

static void put_text(json_t *object, const char *key, const char *text)
{
	if (*text)
		json_object_set_new(object, key, json_string(text));
}

static json_t *revision_json(const struct revision *r)
{
	json_t *object = json_pack("{s:i, s:b}", "number", (int)r->number, "in_force", r->in_force);
	const struct rig_worth *worth = &r->worth;

	if (!r->has_worth)
		return object;
	put_text(object, "revision", worth->revision);
	put_text(object, "software", worth->software);
	put_text(object, "made_by", worth->made_by);
	put_text(object, "made_from", worth->made_from);
	if (worth->judged)
		json_object_set_new(object, "passed", json_boolean(!worth->failed));
	if (worth->poses)
		json_object_set_new(object, "poses", json_integer(worth->poses));
	put_number(object, "rms_px", worth->rms_px);
	put_number(object, "held_out_px", worth->held_out_px);
	put_number(object, "worst_mm", worth->worst_mm);
	return object;
}

static void print_revision(const struct revision *r)
{
	const struct rig_worth *worth = &r->worth;

	printf("%c %04u  ", r->in_force ? '*' : ' ', r->number);
	if (!r->has_worth)
		printf("from before, or made elsewhere\n");
	else if (*worth->made_by)
		printf("%s  %s of %s\n", worth->revision, worth->made_by,
		       *worth->made_from ? worth->made_from : "a rig from before");
	else
		printf("%s  rms %.4f px, held out %.4f px, worst %.4f mm, %d poses%s\n",
		       worth->revision, worth->rms_px, worth->held_out_px, worth->worst_mm,
		       worth->poses, worth->failed ? ", FAILED" : "");
}

/* One that cannot be read is a message and does not hide the others. */
static int list(const struct asked *asked, struct diag *diag)
{
	uint32_t *numbers = calloc(RIG_REVISION_MAX, sizeof(*numbers));
	json_t *all = json_array();
	int count = numbers ? rig_store_list(asked->rig_dir, numbers, diag) : -ENOMEM;
	int err = count < 0 ? count : 0;

	for (int i = 0; i < count; i++) {
		struct revision revision;
		int one = take_revision(&revision, asked->rig_dir, numbers[i], diag);

		err = err ? err : one;
		if (asked->json)
			json_array_append_new(all, revision_json(&revision));
		else if (one)
			printf("%c %04u  its rig.yaml cannot be read\n",
			       revision.in_force ? '*' : ' ', numbers[i]);
		else
			print_revision(&revision);
	}
	if (count >= 0 && asked->json)
		print_json(json_incref(all));
	else if (count == 0)
		printf("%s has no revisions yet\n", asked->rig_dir);
	json_decref(all);
	free(numbers);
	return err;
}

static int print_facts(const struct asked *asked, const struct revision *revision,
		       struct diag *diag)
{
	char path[PATH_MAX], *text;
	size_t size;
	int err = facts_path(path, asked->rig_dir, revision->number, diag);

	if (!err)
		err = file_read(&text, &size, path, FACTS_SIZE_MAX, diag);
	if (err)
		return err;
	printf("# %s, %04u%s\n%s", asked->rig_dir, revision->number,
	       revision->in_force ? ", in force" : "", text);
	free(text);
	return 0;
}

static int take_asked(struct revision *revision, const char *rig_dir, uint32_t number,
		      struct diag *diag)
{
	int err = check_revision(rig_dir, number, diag);

	return err ? err : take_revision(revision, rig_dir, number, diag);
}

static int show(const struct asked *asked, struct diag *diag)
{
	uint32_t number =
		asked->number ? (uint32_t)asked->number : rig_store_in_force(asked->rig_dir);
	struct revision revision;

	if (!number) {
		diag_add(diag,
			 "%s: no revision is in force, as it was not made here; stagectl calibrate "
			 "cameras makes one",
			 asked->rig_dir);
		return -EINVAL;
	}
	if (number > RIG_REVISION_MAX) {
		diag_add(diag, "%s: no such revision; stagectl calibrate list tells them",
			 asked->rig_dir);
		return -EINVAL;
	}
	int err = take_asked(&revision, asked->rig_dir, number, diag);
	if (err)
		return err;
	if (!asked->json)
		return print_facts(asked, &revision, diag);
	print_json(revision_json(&revision));
	return 0;
}

/* The last one before the present that has not failed. */
static uint32_t find_earlier(const struct asked *asked, struct diag *diag)
{
	uint32_t *numbers = calloc(RIG_REVISION_MAX, sizeof(*numbers));
	uint32_t present = rig_store_in_force(asked->rig_dir), found = 0;
	int count = numbers ? rig_store_list(asked->rig_dir, numbers, diag) : 0;
	struct revision revision;

	for (int i = 0; i < count && numbers[i] < present; i++)
		if (!take_revision(&revision, asked->rig_dir, numbers[i], diag) &&
		    !revision.worth.failed)
			found = numbers[i];
	free(numbers);
	return found;
}

static int roll_back(const struct asked *asked, struct diag *diag)
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
	int err = take_asked(&revision, asked->rig_dir, number, diag);
	if (err)
		return err;
	if (revision.worth.failed) {
		diag_add(diag, "%s: revision %04u has failed its limits and cannot come into force",
			 asked->rig_dir, number);
		return -EINVAL;
	}
	err = rig_store_put_in_force(asked->rig_dir, number, &kept, diag);
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

/* Nobody calibrates meanwhile. */
static int rollback(const struct asked *asked, struct diag *diag)
{
	int lock_fd, err = rig_store_lock(&lock_fd, asked->rig_dir, diag);

	if (err)
		return err;
	err = roll_back(asked, diag);
	rig_store_unlock(lock_fd, asked->rig_dir);
	return err;
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
	return err == -EBUSY ? EXIT_CODE_RUNNING : exit_code_of(err, EXIT_CODE_BAD_INPUT);
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
