/*
 * The files with which a station looks at a scene: rig, layout, configuration. No truth.
 */
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "sim/world/scene_parts.h"

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

static void print_layout(FILE *file, const struct layout *layout, uint32_t actor)
{
	const struct layout_actor *a = &layout->actors[actor];

	fprintf(file, "actor: %s\nmarkers:\n", a->name);
	for (uint32_t m = a->first; m < a->first + a->count; m++) {
		const struct layout_marker *k = &layout->markers[m];

		fprintf(file, "- {name: %s, group: %s, ", k->name, k->group);
		if (*k->segment)
			fprintf(file, "segment: %s, ", k->segment);
		fprintf(file, "rigid: %s, diameter_m: %g, neutral_m: [%.9f, %.9f, %.9f]}\n",
			k->rigid ? "true" : "false", k->diameter_m, k->neutral_m.x, k->neutral_m.y,
			k->neutral_m.z);
	}
}

/* One actor's layout is layout.yaml; those of several bear their names. */
static void layout_name(char name[NAME_BYTES + 16], const struct layout *layout, uint32_t actor)
{
	if (layout->actor_count > 1)
		snprintf(name, NAME_BYTES + 16, "layout-%s.yaml", layout->actors[actor].name);
	else
		snprintf(name, NAME_BYTES + 16, "layout.yaml");
}

static void print_layout_names(FILE *file, const struct layout *layout)
{
	char name[NAME_BYTES + 16];

	if (layout->actor_count <= 1) {
		fprintf(file, "layout: layout.yaml\n");
		return;
	}
	for (uint32_t a = 0; a < layout->actor_count; a++) {
		layout_name(name, layout, a);
		fprintf(file, "%s%s", a ? ", " : "layouts: [", name);
	}
	fprintf(file, "]\n");
}

static void print_board(FILE *file, const struct board *board)
{
	fprintf(file, "calibration:\n  board: {squares_x: %d, squares_y: %d, square_m: %.9g, ",
		board->squares_x, board->squares_y, board->square_m);
	fprintf(file, "tag_part: %.9g, first_id: %d}\n", board->tag_part, board->first_id);
}

static void print_config(FILE *file, const struct sim_scene *scene, const char *const *addresses,
			 const char *extra_yaml)
{
	fprintf(file, "# A simulated stage.\nrig: rig\nrate_hz: %.9g\n", scene->rate_hz);
	print_layout_names(file, &scene->layout);
	if (scene->hd_count && (scene->hd_divider != 4 || scene->hd_phase != 0))
		fprintf(file, "hd: {divider: %u, phase: %u}\n", scene->hd_divider, scene->hd_phase);
	if (scene->script.board)
		print_board(file, &scene->board.print);
	if (extra_yaml)
		fprintf(file, "%s%s", extra_yaml,
			*extra_yaml && extra_yaml[strlen(extra_yaml) - 1] == '\n' ? "" : "\n");
	fprintf(file, "cameras:\n");
	for (uint32_t c = 0; c < scene->camera_count + scene->hd_count; c++)
		fprintf(file, "- {name: %s, address: \"%s\", role: %s}\n", scene->cameras[c].name,
			addresses[c], c < scene->camera_count ? "ir" : "hd");
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

static int finish_file(FILE *file, const char *path, struct diag *diag)
{
	bool bad = ferror(file);

	if (fclose(file) != 0 || bad)
		return fail(diag, path, "write", errno ? errno : EIO);
	return 0;
}

static int write_layouts(const struct sim_scene *scene, const char *dir, struct diag *diag)
{
	const struct layout *layout = &scene->layout;
	uint32_t count = layout->actor_count ? layout->actor_count : 1;
	char path[PATH_MAX], name[NAME_BYTES + 16];
	int err = 0;

	for (uint32_t a = 0; !err && a < count; a++) {
		layout_name(name, layout, a);
		err = path_join(path, dir, name, diag);
		FILE *file = err ? NULL : fopen(path, "w");

		if (err)
			return err;
		if (!file)
			return fail(diag, path, "write", errno);
		print_layout(file, layout, a);
		err = finish_file(file, path, diag);
	}
	return err;
}

int sim_scene_write_config(const struct sim_scene *scene, const char *dir, const char *name,
			   const char *const *addresses, const char *extra_yaml, struct diag *diag)
{
	char path[PATH_MAX];
	int err = path_join(path, dir, name, diag);
	FILE *file = err ? NULL : fopen(path, "w");

	if (err)
		return err;
	if (!file)
		return fail(diag, path, "write", errno);
	print_config(file, scene, addresses, extra_yaml);
	return finish_file(file, path, diag);
}

int sim_scene_write_stage(const struct sim_scene *scene, const char *dir,
			  const char *const *addresses, const char *extra_yaml, struct diag *diag)
{
	int err = make_dir(dir, diag);

	if (!err)
		err = write_rig(scene, dir, diag);
	if (!err)
		err = write_layouts(scene, dir, diag);
	if (!err)
		err = sim_scene_write_config(scene, dir, "stage.yaml", addresses, extra_yaml, diag);
	return err;
}
