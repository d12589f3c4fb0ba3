/*
 * A rig's files, written beside their place and then moved there.
 */
#include "calib/rig_write.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "calib/rig_facts.h"
#include "calib/rt.h"
#include "config/rig.h"

#define MODEL_SUFFIX ".cameramodel"
#define PATH_BYTES (PATH_MAX + NAME_MAX + 2) /* of a file in a directory */

static int fail_at(const char *path, int err, struct diag *diag)
{
	diag_add(diag, "%s: cannot write: %s", path, strerror(err));
	return -err;
}

/* Closes; all bytes are on the disk when it returns 0. */
static int finish_file(FILE *file, const char *path, struct diag *diag)
{
	int err = ferror(file) || fflush(file) || fsync(fileno(file)) ? errno : 0;

	if (fclose(file) && !err)
		err = errno;
	return err ? fail_at(path, err, diag) : 0;
}

static void print_list(FILE *file, const char *key, const double *values, uint32_t count)
{
	fprintf(file, "    '%s': [", key);
	for (uint32_t i = 0; i < count; i++)
		fprintf(file, " %.17g,", values[i]);
	fprintf(file, " ],\n");
}

static int write_model(const char *dir, const struct rig_facts *facts, uint32_t c,
		       struct diag *diag)
{
	const struct solution *solution = facts->solution;
	const struct observed_camera *camera = &facts->observations->cameras[c];
	struct pose rt_cam_ref = pose_from_rt(solution->rt_cam_ref[c]);
	struct pose rt_ref_stage = pose_inverse(&facts->rt_stage_ref);
	struct pose rt_cam_stage = pose_compose(&rt_cam_ref, &rt_ref_stage);
	char path[PATH_BYTES];
	double rt[6];

	snprintf(path, sizeof(path), "%s/%s" MODEL_SUFFIX, dir, camera->name);
	FILE *file = fopen(path, "wxe");
	if (!file)
		return fail_at(path, errno, diag);
	pose_to_rt(&rt_cam_stage, rt);
	fprintf(file, "{\n    'lensmodel': '%s',\n", solution->lens);
	print_list(file, "intrinsics", solution->intrinsics + c * solution->lens_count,
		   solution->lens_count);
	print_list(file, "extrinsics", rt, 6); /* mrcal: rt_cam_ref; the reference is the stage */
	fprintf(file, "    'imagersize': [ %d, %d ],\n}\n", camera->width_px, camera->height_px);
	return finish_file(file, path, diag);
}

static int write_facts(const char *dir, const struct rig_facts *facts, const char *revision,
		       struct diag *diag)
{
	char path[PATH_BYTES];

	snprintf(path, sizeof(path), "%s/rig.yaml", dir);
	FILE *file = fopen(path, "wxe");
	if (!file)
		return fail_at(path, errno, diag);
	rig_facts_print(file, facts, revision);
	return finish_file(file, path, diag);
}

/* Loads it as the station does. */
static int try_rig(const char *dir, const struct rig_facts *facts, char revision[17],
		   struct diag *diag)
{
	const struct observations *o = facts->observations;
	char names[CAMERA_MAX][NAME_BYTES];
	struct rig *rig = calloc(1, sizeof(*rig));

	if (!rig)
		return -ENOMEM;
	for (uint32_t c = 0; c < o->camera_count; c++)
		memcpy(names[c], o->cameras[c].name, NAME_BYTES);
	int err = rig_load(rig, dir, (const char(*)[NAME_BYTES])names, o->camera_count, diag);
	if (!err) {
		memcpy(revision, rig->revision, sizeof(rig->revision));
		rig_finish(rig);
	}
	free(rig);
	return err;
}

static void remove_dir(const char *dir)
{
	char path[PATH_BYTES];
	struct dirent *entry;
	DIR *listing = opendir(dir);

	while (listing && (entry = readdir(listing))) {
		if (!strcmp(entry->d_name, ".") || !strcmp(entry->d_name, ".."))
			continue;
		snprintf(path, sizeof(path), "%s/%s", dir, entry->d_name);
		unlink(path);
	}
	if (listing)
		closedir(listing);
	rmdir(dir);
}

static int sync_dir(const char *dir)
{
	int fd = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

	if (fd < 0)
		return -errno;
	int err = fsync(fd) ? -errno : 0;
	close(fd);
	return err;
}

static int fill(const char *dir, const struct rig_facts *facts, char revision[17],
		struct diag *diag)
{
	int err = 0;

	for (uint32_t c = 0; !err && c < facts->solution->camera_count; c++)
		err = write_model(dir, facts, c, diag);
	if (!err)
		err = try_rig(dir, facts, revision, diag);
	if (!err)
		err = write_facts(dir, facts, revision, diag);
	if (!err && sync_dir(dir))
		err = fail_at(dir, errno, diag);
	return err;
}

int rig_write(const char *dir, const struct rig_facts *facts, char revision[17], struct diag *diag)
{
	char temporary[PATH_MAX], made[17];

	if (snprintf(temporary, sizeof(temporary), "%s.XXXXXX", dir) >= (int)sizeof(temporary))
		return fail_at(dir, ENAMETOOLONG, diag);
	if (!mkdtemp(temporary))
		return fail_at(temporary, errno, diag);
	int err = chmod(temporary, 0755) ? fail_at(temporary, errno, diag)
					 : fill(temporary, facts, made, diag);
	if (err)
		goto fail;

	if (renameat2(AT_FDCWD, temporary, AT_FDCWD, dir, RENAME_NOREPLACE)) {
		err = fail_at(dir, errno, diag);
		goto fail;
	}
	memcpy(revision, made, sizeof(made));
	return 0;
fail:
	remove_dir(temporary);
	return err;
}
