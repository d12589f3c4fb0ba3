/*
 * Links and directories.
 */
#include "calib/rig/rig_store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static int fail(const char *path, const char *what, int err, struct diag *diag)
{
	diag_add(diag, "%s: cannot %s: %s", path, what, strerror(err));
	return -err;
}

/* Without a slash at its end, which would follow the link. */
static int plain(char path[PATH_MAX], const char *rig_dir, struct diag *diag)
{
	size_t length = strlen(rig_dir);

	while (length > 1 && rig_dir[length - 1] == '/')
		length--;
	if (length == 0 || length >= RIG_STORE_PATH)
		return fail(rig_dir, "be a rig", length ? ENAMETOOLONG : EINVAL, diag);
	memcpy(path, rig_dir, length);
	path[length] = '\0';
	return 0;
}

int rig_store_path(char path[PATH_MAX], const char *rig_dir, const char *name, bool make,
		   struct diag *diag)
{
	char store[PATH_MAX];
	int err = plain(store, rig_dir, diag);

	if (err)
		return err;
	strcat(store, ".d");
	if (make && mkdir(store, 0777) && errno != EEXIST)
		return fail(store, "make the directory", errno, diag);
	if (snprintf(path, PATH_MAX, "%s%s%s", store, name ? "/" : "", name ? name : "") >=
	    PATH_MAX)
		return fail(store, "name a file there", ENAMETOOLONG, diag);
	return 0;
}

int rig_store_lock(int *fd, const char *rig_dir, struct diag *diag)
{
	char path[PATH_MAX];
	int err = rig_store_path(path, rig_dir, NULL, true, diag);

	if (err)
		return err;
	int opened = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (opened < 0)
		return fail(path, "open", errno, diag);
	if (flock(opened, LOCK_EX | LOCK_NB)) {
		err = errno == EWOULDBLOCK ? -EBUSY : fail(path, "lock", errno, diag);
		close(opened);
		if (err == -EBUSY)
			diag_add(diag, "%s: another program calibrates this rig: wait for it",
				 rig_dir);
		return err;
	}
	*fd = opened;
	return 0;
}

int rig_store_revision_path(char path[PATH_MAX], const char *rig_dir, uint32_t number,
			    struct diag *diag)
{
	char name[16];

	snprintf(name, sizeof(name), "%04u", number);
	return rig_store_path(path, rig_dir, name, false, diag);
}

/* 0: not a revision's name. */
static uint32_t number_of(const char *name)
{
	if (strlen(name) != 4 || strspn(name, "0123456789") != 4)
		return 0;
	return (uint32_t)strtoul(name, NULL, 10);
}

static int compare(const void *a, const void *b)
{
	uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;

	return (x > y) - (x < y);
}

int rig_store_list(const char *rig_dir, uint32_t *numbers, struct diag *diag)
{
	char path[PATH_MAX];
	struct dirent *entry;
	int count = 0, err = rig_store_path(path, rig_dir, NULL, false, diag);

	if (err)
		return err;
	DIR *listing = opendir(path);
	if (!listing)
		return errno == ENOENT ? 0 : fail(path, "list", errno, diag);
	while ((entry = readdir(listing)) && count < RIG_REVISION_MAX)
		if (number_of(entry->d_name))
			numbers[count++] = number_of(entry->d_name);
	closedir(listing);
	qsort(numbers, (size_t)count, sizeof(*numbers), compare);
	return count;
}

uint32_t rig_store_in_force(const char *rig_dir)
{
	char path[PATH_MAX], target[PATH_MAX];

	if (plain(path, rig_dir, NULL))
		return 0;
	ssize_t length = readlink(path, target, sizeof(target) - 1);
	if (length <= 0)
		return 0;
	target[length] = '\0';
	const char *slash = strrchr(target, '/');
	return number_of(slash ? slash + 1 : target);
}

static bool is_plain_dir(const char *path)
{
	struct stat st;

	return !lstat(path, &st) && S_ISDIR(st.st_mode);
}

int rig_store_next(const char *rig_dir, uint32_t *number, struct diag *diag)
{
	uint32_t *numbers = calloc(RIG_REVISION_MAX, sizeof(*numbers));
	int count = numbers ? rig_store_list(rig_dir, numbers, diag) : -ENOMEM;
	uint32_t last = count > 0 ? numbers[count - 1] : 0;
	char path[PATH_MAX];

	free(numbers);
	if (count < 0)
		return count;
	int err = plain(path, rig_dir, diag);
	if (err)
		return err;
	last += is_plain_dir(path); /* the number before is for that one */
	if (last >= RIG_REVISION_MAX)
		return fail(rig_dir, "count further than 9999 revisions", ENOSPC, diag);
	*number = last + 1;
	return 0;
}

/* The link takes the place of the directory, which becomes the revision before. */
static int exchange(const char *link, const char *path, uint32_t number, uint32_t *kept,
		    struct diag *diag)
{
	char revision[PATH_MAX];
	int err = rig_store_revision_path(revision, path, number - 1, diag);

	if (err)
		return err;
	if (renameat2(AT_FDCWD, link, AT_FDCWD, path, RENAME_EXCHANGE))
		return fail(path, "put the new rig in its place", errno, diag);
	if (renameat2(AT_FDCWD, link, AT_FDCWD, revision, RENAME_NOREPLACE)) {
		err = fail(revision, "keep the rig from before", errno, diag);
		renameat2(AT_FDCWD, link, AT_FDCWD, path, RENAME_EXCHANGE);
		return err;
	}
	*kept = number - 1;
	return 0;
}

int rig_store_put_in_force(const char *rig_dir, uint32_t number, uint32_t *kept, struct diag *diag)
{
	char path[PATH_MAX], link[PATH_MAX], target[PATH_MAX], revision[PATH_MAX];
	struct stat st;
	int err = plain(path, rig_dir, diag);

	if (!err)
		err = rig_store_revision_path(revision, rig_dir, number, diag);
	if (err)
		return err;
	if (stat(revision, &st) || !S_ISDIR(st.st_mode))
		return fail(revision, "bring into force", ENOENT, diag);
	const char *slash = strrchr(path, '/');
	snprintf(target, sizeof(target), "%.*s.d/%04u", NAME_MAX, slash ? slash + 1 : path, number);
	/* made beside RIG, as what it says is relative to its place */
	snprintf(link, sizeof(link), "%.*s.next", RIG_STORE_PATH, path);
	unlink(link);
	if (symlink(target, link))
		return fail(link, "write", errno, diag);
	*kept = 0;
	if (is_plain_dir(path))
		err = exchange(link, path, number, kept, diag);
	else if (rename(link, path))
		err = fail(path, "put the new rig in its place", errno, diag);
	if (err)
		unlink(link);
	return err;
}
