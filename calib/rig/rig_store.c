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

#include "config/rig.h"

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

/* What every link to a revision says, before the number. */
static void link_start(char start[PATH_MAX], const char *path)
{
	const char *slash = strrchr(path, '/');

	snprintf(start, PATH_MAX, "%.*s.d/", NAME_MAX, slash ? slash + 1 : path);
}

/* The revision that the link at `path` names; 0: none, `target` says where else it leads. */
static uint32_t linked_revision(const char *path, char target[PATH_MAX])
{
	char start[PATH_MAX];
	ssize_t length = readlink(path, target, PATH_MAX - 1);

	target[length > 0 ? length : 0] = '\0';
	link_start(start, path);
	return strncmp(target, start, strlen(start)) || strchr(target + strlen(start), '/')
		       ? 0
		       : rig_revision_number(target);
}

int rig_store_check(const char *rig_dir, struct diag *diag)
{
	char path[PATH_MAX], target[PATH_MAX];
	struct stat st;
	int err = plain(path, rig_dir, diag);

	if (err)
		return err;
	if (lstat(path, &st))
		return errno == ENOENT ? 0 : fail(path, "look at", errno, diag);
	if (S_ISDIR(st.st_mode) || (S_ISLNK(st.st_mode) && linked_revision(path, target)))
		return 0;
	if (S_ISLNK(st.st_mode))
		diag_add(diag,
			 "%s: is a link to %s, which no calibration has made and none replaces: "
			 "name %s itself as the rig, or remove the link",
			 path, target, target);
	else
		diag_add(diag,
			 "%s: is no directory, and a rig is one: name another place for the rig, "
			 "or move this away",
			 path);
	return -EEXIST;
}

/* Makes RIG.d and has it open; -EAGAIN: another one removed it meanwhile. */
static int try_lock(int *fd, const char *rig_dir, struct diag *diag)
{
	char path[PATH_MAX];
	struct stat st;
	int err = rig_store_path(path, rig_dir, NULL, true, diag);

	if (err)
		return err;
	int opened = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (opened < 0)
		return errno == ENOENT ? -EAGAIN : fail(path, "open", errno, diag);
	if (flock(opened, LOCK_EX | LOCK_NB))
		err = errno == EWOULDBLOCK ? -EBUSY : fail(path, "lock", errno, diag);
	else if (fstat(opened, &st) || st.st_nlink == 0)
		err = -EAGAIN;
	if (err)
		close(opened);
	else
		*fd = opened;
	return err;
}

int rig_store_lock(int *fd, const char *rig_dir, struct diag *diag)
{
	int err = rig_store_check(rig_dir, diag);

	if (err)
		return err;
	do
		err = try_lock(fd, rig_dir, diag);
	while (err == -EAGAIN);
	if (err == -EBUSY)
		diag_add(diag, "%s: another program calibrates this rig: wait for it", rig_dir);
	return err;
}

void rig_store_unlock(int fd, const char *rig_dir)
{
	char path[PATH_MAX];

	if (fd < 0)
		return;
	if (!rig_store_path(path, rig_dir, NULL, false, NULL))
		rmdir(path); /* only when nothing came of it */
	close(fd);
}

int rig_store_revision_path(char path[PATH_MAX], const char *rig_dir, uint32_t number,
			    struct diag *diag)
{
	char name[16];

	snprintf(name, sizeof(name), "%04u", number);
	return rig_store_path(path, rig_dir, name, false, diag);
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
		if (rig_revision_number(entry->d_name))
			numbers[count++] = rig_revision_number(entry->d_name);
	closedir(listing);
	qsort(numbers, (size_t)count, sizeof(*numbers), compare);
	return count;
}

uint32_t rig_store_in_force(const char *rig_dir)
{
	char path[PATH_MAX], target[PATH_MAX];

	return plain(path, rig_dir, NULL) ? 0 : linked_revision(path, target);
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
	int err = rig_store_check(rig_dir, diag);

	if (!err)
		err = plain(path, rig_dir, diag);
	if (!err)
		err = rig_store_revision_path(revision, rig_dir, number, diag);
	if (err)
		return err;
	if (stat(revision, &st) || !S_ISDIR(st.st_mode))
		return fail(revision, "bring into force", ENOENT, diag);
	link_start(target, path);
	snprintf(target + strlen(target), PATH_MAX - strlen(target), "%04u", number);
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
