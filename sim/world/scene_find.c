/*
 * Names of scenes and the files behind them. SCENES_BUILT_AT, SCENES_SOURCE and SCENES_INSTALLED
 * come from meson.build.
 */
#include "sim/world/scene_find.h"

#include <dirent.h>
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SUFFIX ".yaml"

static const char *scene_dir(void)
{
	char program[PATH_MAX];
	ssize_t length = readlink("/proc/self/exe", program, sizeof(program));
	size_t built = strlen(SCENES_BUILT_AT "/");

	if (length > (ssize_t)built && memcmp(program, SCENES_BUILT_AT "/", built) == 0)
		return SCENES_SOURCE;
	return SCENES_INSTALLED;
}

/* Of a name without its suffix; 0 when the file is no scene. */
static size_t name_length(const char *file)
{
	size_t length = strlen(file), suffix = strlen(SUFFIX);

	if (length <= suffix || *file == '.' || strcmp(file + length - suffix, SUFFIX) != 0)
		return 0;
	return length - suffix < NAME_BYTES ? length - suffix : 0;
}

static int by_name(const void *a, const void *b)
{
	return strcmp(a, b);
}

int scene_names(char names[SCENE_NAMES_MAX][NAME_BYTES], size_t *count, struct diag *diag)
{
	const char *path = scene_dir();
	DIR *dir = opendir(path);
	size_t found = 0;

	if (!dir) {
		int err = errno;

		diag_add(diag, "%s: cannot list the scenes: %s", path, strerror(err));
		return -err;
	}
	for (struct dirent *entry; found < SCENE_NAMES_MAX && (entry = readdir(dir));) {
		size_t length = name_length(entry->d_name);

		if (length)
			snprintf(names[found++], NAME_BYTES, "%.*s", (int)length, entry->d_name);
	}
	closedir(dir);
	qsort(names, found, NAME_BYTES, by_name);
	*count = found;
	return 0;
}

static void complain(const char *scene, struct diag *diag)
{
	static char names[SCENE_NAMES_MAX][NAME_BYTES]; /* control thread only */
	char known[1024] = "";
	size_t count = 0;

	if (scene_names(names, &count, diag))
		return;
	for (size_t i = 0; i < count; i++) {
		size_t used = strlen(known);

		snprintf(known + used, sizeof(known) - used, "%s%.60s", used ? ", " : "", names[i]);
	}
	diag_add(diag, "sim: no scene '%.64s': use one of %s, or the path of a scene's file", scene,
		 known);
}

int scene_find(char path[PATH_MAX], const char *scene, struct diag *diag)
{
	bool is_path = strchr(scene, '/') || name_length(scene);
	int length = is_path ? snprintf(path, PATH_MAX, "%s", scene)
			     : snprintf(path, PATH_MAX, "%s/%s" SUFFIX, scene_dir(), scene);

	if (length >= PATH_MAX) {
		diag_add(diag, "sim: scene %.60s...: %s", scene, strerror(ENAMETOOLONG));
		return -ENAMETOOLONG;
	}
	if (is_path || access(path, F_OK) == 0)
		return 0;
	complain(scene, diag);
	return -EINVAL;
}
