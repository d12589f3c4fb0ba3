/*
 * Directories and files of a recording.
 */
#include "sim/record_files.h"

#include <dirent.h>
#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int record_fail(struct diag *diag, const char *path, const char *what, int err)
{
	const char *remedy = err == ENOSPC ? ": free some space, or record fewer seconds" : "";

	diag_add(diag, "%s: cannot %s: %s%s", path, what, strerror(err), remedy);
	return -err;
}

int record_path(struct diag *diag, char path[PATH_MAX], const char *format, ...)
{
	va_list args;

	va_start(args, format);
	int length = vsnprintf(path, PATH_MAX, format, args);
	va_end(args);
	if (length < PATH_MAX)
		return 0;
	return record_fail(diag, path, "use such a long path", ENAMETOOLONG);
}

int part_file_open(struct part_file *part, const char *path, struct diag *diag)
{
	int err = record_path(diag, part->path, "%s", path);

	if (!err)
		err = record_path(diag, part->part_path, "%s.part", path);
	if (err)
		return err;
	part->file = fopen(part->part_path, "w");
	if (!part->file)
		return record_fail(diag, part->part_path, "write", errno);
	if (unlink(part->path) != 0 && errno != ENOENT)
		return record_fail(diag, part->path, "replace", errno);
	return 0;
}

int part_file_finish(struct part_file *part, struct diag *diag)
{
	bool bad = ferror(part->file);
	bool unflushed = fclose(part->file) != 0;

	part->file = NULL;
	if (bad || unflushed)
		return record_fail(diag, part->part_path, "write", errno ? errno : EIO);
	if (rename(part->part_path, part->path) != 0)
		return record_fail(diag, part->path, "give the finished file this name", errno);
	return 0;
}

typedef int visit_fn(const char *dir, const char *name, struct diag *diag);

/* Calls for every entry but . and ..; stops at the first result that is not 0 and returns it. */
static int each_entry(const char *path, visit_fn *visit, struct diag *diag)
{
	DIR *dir = opendir(path);
	int err = 0;

	if (!dir)
		return record_fail(diag, path, "list", errno);
	for (struct dirent *entry; !err && (entry = readdir(dir));)
		if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
			err = visit(path, entry->d_name, diag);
	closedir(dir);
	return err;
}

static int stop_at_any(const char *dir, const char *name, struct diag *diag)
{
	(void)dir, (void)name, (void)diag;
	return 1;
}

int record_claim_dir(const char *dir, const char *mark, struct diag *diag)
{
	char done[PATH_MAX], part[PATH_MAX];

	if (mkdir(dir, 0777) == 0)
		return 0;
	if (errno != EEXIST)
		return record_fail(diag, dir, "make the directory", errno);
	int found = each_entry(dir, stop_at_any, diag);

	if (found <= 0)
		return found;
	int err = record_path(diag, done, "%s/%s", dir, mark);

	if (!err)
		err = record_path(diag, part, "%s/%s.part", dir, mark);
	if (err || access(done, F_OK) == 0 || access(part, F_OK) == 0)
		return err;
	diag_add(diag,
		 "%s: not empty, and not a simulated recording (no %s): choose another directory",
		 dir, mark);
	return -EEXIST;
}

static int remove_image(const char *dir, const char *name, struct diag *diag)
{
	char path[PATH_MAX];
	size_t length = strlen(name);

	if (length < 4 || strcmp(name + length - 4, ".pgm") != 0)
		return 0;
	int err = record_path(diag, path, "%s/%s", dir, name);

	if (!err && unlink(path) != 0)
		err = record_fail(diag, path, "remove the old image", errno);
	return err;
}

int record_clear_images(const char *dir, struct diag *diag)
{
	if (mkdir(dir, 0777) != 0 && errno != EEXIST)
		return record_fail(diag, dir, "make the directory", errno);
	return each_entry(dir, remove_image, diag);
}
