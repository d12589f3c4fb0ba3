/*
 * The files with which a station looks at a scene: rig, layout, configuration. No truth.
 */
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "sim/scene_parts.h"

static int fail(struct diag *diag, const char *path, const char *what, int err)
{
	diag_add(diag, "%s: cannot %s: %s", path, what, strerror(err));
	return -err;
}

static int make_dir(const char *path, struct diag *diag)
{
	if (mkdir(path, 0777) == 0 || errno == EEXIST)
		return 0;
	return fail(diag, path, "make the directory", errno);
}

static void print_layout(FILE *file, const struct sim_scene *scene)
{
	const struct layout *layout = &scene->layout;

	fprintf(file, "actor: %s\nmarkers:\n", layout->actors[0].name);
	for (uint32_t m = 0; m < layout->marker_count; m++) {
		const struct layout_marker *k = &layout->markers[m];

		fprintf(file,
			"- {name: %s, group: %s, rigid: %s, diameter_m: %g, "
			"neutral_m: [%.9f, %.9f, %.9f]}\n",
			k->name, k->group, k->rigid ? "true" : "false", k->diameter_m,
			k->neutral_m.x, k->neutral_m.y, k->neutral_m.z);
	}
}

static void print_config(FILE *file, const struct sim_scene *scene, const char *const *addresses,
			 const char *extra_yaml)
{
	fprintf(file, "# A simulated stage.\nrig: rig\nlayout: layout.yaml\nrate_hz: %.9g\n",
		scene->rate_hz);
	if (scene->hd_count && (scene->hd_divider != 4 || scene->hd_phase != 0))
		fprintf(file, "hd: {divider: %u, phase: %u}\n", scene->hd_divider, scene->hd_phase);
	if (extra_yaml)
		fprintf(file, "%s%s", extra_yaml,
			*extra_yaml && extra_yaml[strlen(extra_yaml) - 1] == '\n' ? "" : "\n");
	fprintf(file, "cameras:\n");
	for (uint32_t c = 0; c < scene->camera_count + scene->hd_count; c++)
		fprintf(file, "- {name: %s, address: \"%s\", role: %s}\n", scene->cameras[c].name,
			addresses[c], c < scene->camera_count ? "ir" : "hd");
}

/* Addresses NULL: the layout, else the configuration. */
static int write_yaml(const struct sim_scene *scene, const char *path, const char *const *addresses,
		      const char *extra_yaml, struct diag *diag)
{
	FILE *file = fopen(path, "w");

	if (!file)
		return fail(diag, path, "write", errno);
	if (addresses)
		print_config(file, scene, addresses, extra_yaml);
	else
		print_layout(file, scene);
	bool bad = ferror(file);
	if (fclose(file) != 0 || bad)
		return fail(diag, path, "write", errno ? errno : EIO);
	return 0;
}

static int path_join(char path[PATH_MAX], const char *dir, const char *name, struct diag *diag)
{
	if (snprintf(path, PATH_MAX, "%s/%s", dir, name) < PATH_MAX)
		return 0;
	diag_add(diag, "%s: path too long", dir);
	return -ENAMETOOLONG;
}

static int write_rig(const struct sim_scene *scene, const char *dir, struct diag *diag)
{
	char path[PATH_MAX], name[NAME_BYTES + 32];
	int err = path_join(path, dir, "rig", diag);

	if (!err)
		err = make_dir(path, diag);
	for (uint32_t c = 0; !err && c < scene->camera_count + scene->hd_count; c++) {
		snprintf(name, sizeof(name), "rig/%s.cameramodel", scene->cameras[c].name);
		err = path_join(path, dir, name, diag);
		if (!err)
			err = sim_camera_write(&scene->cameras[c], path, diag);
	}
	return err;
}

int sim_scene_write_stage(const struct sim_scene *scene, const char *dir,
			  const char *const *addresses, const char *extra_yaml, struct diag *diag)
{
	char layout_path[PATH_MAX], config_path[PATH_MAX];
	int err = path_join(layout_path, dir, "layout.yaml", diag);

	if (!err)
		err = path_join(config_path, dir, "stage.yaml", diag);
	if (!err)
		err = make_dir(dir, diag);
	if (!err)
		err = write_rig(scene, dir, diag);
	if (!err)
		err = write_yaml(scene, layout_path, NULL, NULL, diag);
	if (!err)
		err = write_yaml(scene, config_path, addresses, extra_yaml, diag);
	return err;
}
