/*
 * Written beside its place, then moved there.
 */
#include "calib/rig/rig_dir.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "config/rig.h"

int rig_dir_fail(const char *path, int err, struct diag *diag)
{
	diag_add(diag, "%s: cannot write: %s", path, strerror(err));
	return -err;
}

FILE *rig_dir_file(const char *dir, const char *name, char path[RIG_FILE_BYTES], struct diag *diag)
{
	snprintf(path, RIG_FILE_BYTES, "%s/%s", dir, name);
	FILE *file = fopen(path, "wxe");

	if (!file)
		rig_dir_fail(path, errno, diag);
	return file;
}

int rig_dir_finish_file(FILE *file, const char *path, struct diag *diag)
{
	int err = ferror(file) || fflush(file) || fsync(fileno(file)) ? errno : 0;

	if (fclose(file) && !err)
		err = errno;
	return err ? rig_dir_fail(path, err, diag) : 0;
}

int rig_dir_try(const char *dir, const char (*names)[NAME_BYTES], uint32_t count, char revision[17],
		struct diag *diag)
{
	struct rig *rig = calloc(1, sizeof(*rig));

	if (!rig)
		return -ENOMEM;
	int err = rig_load(rig, dir, names, count, diag);
	if (!err) {
		memcpy(revision, rig->revision, sizeof(rig->revision));
		rig_finish(rig);
	}
	free(rig);
	return err;
}

static void remove_dir(const char *dir)
{
	char path[RIG_FILE_BYTES];
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

int rig_dir_make(const char *dir, rig_dir_fill_fn *fill, void *user, struct diag *diag)
{
	char temporary[PATH_MAX];

	if (snprintf(temporary, sizeof(temporary), "%s.XXXXXX", dir) >= (int)sizeof(temporary))
		return rig_dir_fail(dir, ENAMETOOLONG, diag);
	if (!mkdtemp(temporary))
		return rig_dir_fail(temporary, errno, diag);
	int err = chmod(temporary, 0755) ? rig_dir_fail(temporary, errno, diag)
					 : fill(temporary, user, diag);
	if (!err && sync_dir(temporary))
		err = rig_dir_fail(temporary, errno, diag);
	if (!err && renameat2(AT_FDCWD, temporary, AT_FDCWD, dir, RENAME_NOREPLACE))
		err = rig_dir_fail(dir, errno, diag);
	if (err)
		remove_dir(temporary);
	return err;
}
