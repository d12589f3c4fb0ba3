/*
 * Copies models, with other numbers behind 'extrinsics'.
 */
#include "calib/rig/rig_move.h"

#include <dirent.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "calib/rig/rig_dir.h"
#include "calib/rig/rig_store.h"
#include "calib/rt.h"
#include "config/model_text.h"

#define MODEL_SIZE_MAX (16 << 20)

struct moving {
	const char *rig_dir;
	const struct rig_move *move;
	uint32_t before; /* the revision in force until now; 0: a plain directory */
	char revision[17];
};

/* The numbers of the pose stand from *begin to *end, the bracket. False: there are none. */
static bool find_pose(const char *text, const char **begin, const char **end, double rt[6])
{
	const char *key = strstr(text, "'extrinsics'");

	if (!key)
		key = strstr(text, "\"extrinsics\"");
	if (!key || !(*begin = strchr(key, '[')))
		return false;
	const char *at = ++*begin;
	for (int i = 0; i < 6; i++) {
		char *after;

		rt[i] = strtod(at, &after);
		if (after == at)
			return false;
		at = after + strspn(after, " ,\n\t");
	}
	*end = at;
	return *at == ']';
}

static bool same(const struct pose *a, const struct pose *b)
{
	return !memcmp(a, b, sizeof(*a));
}

static int write_moved(FILE *file, const char *text, const char *path, const char *camera,
		       const struct rig_move *move, struct diag *diag)
{
	const char *begin, *end;
	double rt[6];

	if (!find_pose(text, &begin, &end, rt)) {
		diag_add(diag, "%s: extrinsics: six numbers are missing", path);
		return -EINVAL;
	}
	struct pose before = pose_from_rt(rt);
	struct pose now = move->pose(camera, &before, move->user);

	if (same(&before, &now)) {
		fputs(text, file);
		return 0;
	}
	pose_to_rt(&now, rt);
	fprintf(file, "%.*s", (int)(begin - text), text);
	for (int i = 0; i < 6; i++)
		fprintf(file, " %.17g,", rt[i]);
	fprintf(file, " %s", end);
	return 0;
}

static int copy_model(const char *dir, const char *name, const struct moving *moving,
		      struct diag *diag)
{
	char from[RIG_FILE_BYTES], to[RIG_FILE_BYTES], camera[NAME_MAX + 1], *text;
	size_t size;

	snprintf(from, sizeof(from), "%s/%s", moving->rig_dir, name);
	snprintf(camera, sizeof(camera), "%.*s", (int)(strlen(name) - strlen(RIG_MODEL_SUFFIX)),
		 name);
	int err = file_read(&text, &size, from, MODEL_SIZE_MAX, diag);
	if (err)
		return err;
	err = model_text_check(text, size, from, diag);
	FILE *file = err ? NULL : rig_dir_file(dir, name, to, diag);
	if (!err && !file)
		err = -EIO;
	if (!err) {
		err = write_moved(file, text, from, camera, moving->move, diag);
		int closed = rig_dir_finish_file(file, to, diag);

		err = err ? err : closed;
	}
	free(text);
	return err;
}

static bool is_model(const char *name)
{
	size_t length = strlen(name), suffix = strlen(RIG_MODEL_SUFFIX);

	return length > suffix && !strcmp(name + length - suffix, RIG_MODEL_SUFFIX);
}

static int copy_models(const char *dir, const struct moving *moving, struct diag *diag)
{
	DIR *listing = opendir(moving->rig_dir);
	struct dirent *entry;
	int err = 0;

	if (!listing) {
		err = -errno;
		diag_add(diag, "%s: cannot read: %s", moving->rig_dir, strerror(-err));
		return err;
	}
	while (!err && (entry = readdir(listing)))
		if (is_model(entry->d_name))
			err = copy_model(dir, entry->d_name, moving, diag);
	closedir(listing);
	return err;
}

static int fill(const char *dir, void *user, struct diag *diag)
{
	struct moving *moving = user;
	const struct rig_move *move = moving->move;
	char path[RIG_FILE_BYTES];
	int err = copy_models(dir, moving, diag);

	if (!err)
		err = rig_dir_try(dir, move->names, move->count, moving->revision, diag);
	FILE *file = err ? NULL : rig_dir_file(dir, "rig.yaml", path, diag);
	if (!file)
		return err ? err : -EIO;
	fprintf(file, "revision: \"%s\" # of the IR cameras\nsoftware: \"%s\"\nmade_by: %s\n",
		moving->revision, move->software, move->what);
	if (moving->before)
		fprintf(file, "made_from: %04u # its rig.yaml tells of the lenses\n",
			moving->before);
	fputs(move->details, file);
	return rig_dir_finish_file(file, path, diag);
}

static int move_locked(struct rig_moved *moved, const char *rig_dir, const struct rig_move *move,
		       struct diag *diag)
{
	struct moving moving = {
		.rig_dir = rig_dir, .move = move, .before = rig_store_in_force(rig_dir)};
	char dir[PATH_MAX];
	uint32_t number, kept;
	int err = rig_store_path(dir, rig_dir, NULL, true, diag);

	if (!err)
		err = rig_store_next(rig_dir, &number, diag);
	if (!err && !moving.before && number > 1)
		moving.before = number - 1; /* what the plain directory becomes */
	if (!err)
		err = rig_store_revision_path(dir, rig_dir, number, diag);
	if (!err)
		err = rig_dir_make(dir, fill, &moving, diag);
	if (!err)
		err = rig_store_put_in_force(rig_dir, number, &kept, diag);
	if (err)
		return err;
	moved->number = number;
	memcpy(moved->revision, moving.revision, sizeof(moved->revision));
	return 0;
}

int rig_move(struct rig_moved *moved, const char *rig_dir, const struct rig_move *move,
	     struct diag *diag)
{
	int lock_fd, err = rig_store_lock(&lock_fd, rig_dir, diag);

	if (err)
		return err;
	err = move_locked(moved, rig_dir, move, diag);
	rig_store_unlock(lock_fd, rig_dir);
	return err;
}
