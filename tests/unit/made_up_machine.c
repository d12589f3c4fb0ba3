/*
 * Files in /tmp.
 */
#include "made_up_machine.h"

#include <ftw.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

struct machine *machine_create(void)
{
	struct machine *machine = calloc(1, sizeof(*machine));

	assert_non_null(machine);
	strcpy(machine->root, "/tmp/made_up_machineXXXXXX");
	assert_non_null(mkdtemp(machine->root));
	machine->config.plan.period_ns = 10000000;
	machine->config.plan.hd_divider = 4;
	strcpy(machine->config.trigger, "free");
	machine->doctor.root = machine->root;
	machine->doctor.config = &machine->config;
	machine->doctor.facts.asker =
		(struct person){.name = "anna", .uid = 54321, .gid_count = 1, .gids = {54321}};
	machine->doctor.facts.recordings_dir = "/takes";
	return machine;
}

static int take_away(const char *path, const struct stat *st, int kind, struct FTW *ftw)
{
	(void)st;
	(void)kind;
	(void)ftw;
	return remove(path);
}

void machine_destroy(struct machine *machine)
{
	nftw(machine->root, take_away, 16, FTW_DEPTH | FTW_PHYS);
	free(machine);
}

static void make_way(const char *path)
{
	char directory[256];

	for (const char *slash = strchr(path + 1, '/'); slash; slash = strchr(slash + 1, '/')) {
		snprintf(directory, sizeof(directory), "%.*s", (int)(slash - path), path);
		mkdir(directory, 0755);
	}
}

static void whole_path(const struct machine *machine, char whole[256], const char *path)
{
	assert_true(snprintf(whole, 256, "%s%s", machine->root, path) < 256);
}

void machine_write(const struct machine *machine, const char *path, const char *text)
{
	char whole[256];

	whole_path(machine, whole, path);
	make_way(whole);
	FILE *file = fopen(whole, "w");

	assert_non_null(file);
	fputs(text, file);
	fclose(file);
	chmod(whole, 0644);
}

void machine_chmod(const struct machine *machine, const char *path, int mode)
{
	char whole[256];

	whole_path(machine, whole, path);
	assert_int_equal(chmod(whole, (mode_t)mode), 0);
}

void machine_link(const struct machine *machine, const char *path, const char *target)
{
	char whole[256], to[256];

	whole_path(machine, whole, path);
	whole_path(machine, to, target);
	make_way(whole);
	assert_int_equal(symlink(to, whole), 0);
}

void machine_add_camera(struct machine *machine, const char *name, const char *address,
			enum camera_role role, uint64_t frame_bytes)
{
	uint32_t c = machine->config.camera_count++;
	struct config_camera *camera = &machine->config.cameras[c];
	int divider = role == ROLE_HD ? machine->config.plan.hd_divider : 1;

	snprintf(camera->name, sizeof(camera->name), "%s", name);
	snprintf(camera->address, sizeof(camera->address), "%s", address);
	camera->role = role;
	machine->doctor.loads[c] =
		(struct doctor_load){frame_bytes, (double)frame_bytes * 100 / divider};
}

void machine_examine(struct machine *machine, void (*check)(struct doctor *doctor))
{
	machine->doctor.finding_count = 0;
	machine->doctor.topic = "test";
	check(&machine->doctor);
}

static const struct finding *find(const struct machine *machine, const char *what)
{
	const struct doctor *doctor = &machine->doctor;

	for (uint32_t f = 0; f < doctor->finding_count; f++)
		if (strncmp(doctor->findings[f].what, what, strlen(what)) == 0)
			return &doctor->findings[f];
	return NULL;
}

const struct finding *machine_expect(const struct machine *machine, enum finding_level level,
				     const char *what)
{
	const struct finding *finding = find(machine, what);

	if (!finding)
		print_message("no finding of '%s'\n", what);
	assert_non_null(finding);
	if (finding->level != level)
		print_message("%s: %s (%s)\n", finding->what, finding->measured, finding->limit);
	assert_string_equal(finding_level_name(finding->level), finding_level_name(level));
	assert_true(*finding->measured);
	assert_true(level == FINDING_OK ? !*finding->remedy : *finding->remedy);
	return finding;
}

void machine_expect_none(const struct machine *machine, const char *what)
{
	assert_null(find(machine, what));
}
