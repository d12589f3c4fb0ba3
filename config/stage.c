/*
 * Loads config, then layout and rig, and numbers the tracked cameras.
 */
#include "config/stage.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

#include "config/layout_file.h"

/* The rig holds the tracked cameras alone: a camera that is only looked at needs no model. */
static void number_views(struct stage *stage)
{
	uint32_t count = 0;

	for (uint32_t c = 0; c < stage->config.camera_count; c++) {
		bool is_ir = stage->config.cameras[c].role == ROLE_IR;

		stage->ir_mask |= (uint32_t)is_ir << c;
		stage->view_index[c] = is_ir ? count++ : VIEW_NONE;
	}
}

/* `rig` is where it stays: the views of `tracking` point into it. */
static int load_rig(const struct stage *stage, struct rig *rig, struct tracker_rig *tracking,
		    struct diag *diag)
{
	const struct config *config = &stage->config;
	char names[CAMERA_MAX][NAME_BYTES];
	uint32_t count = 0;

	*tracking = (struct tracker_rig){.camera_count = config->camera_count,
					 .layout = &stage->layout,
					 .settings = config->tracking};
	for (uint32_t c = 0; c < config->camera_count; c++) {
		if (stage->view_index[c] == VIEW_NONE)
			continue;
		memcpy(names[count], config->cameras[c].name, NAME_BYTES);
		tracking->views[c] = &rig->views[count++];
	}
	return rig_load(rig, config->rig_dir, names, count, diag);
}

int stage_load_rig_again(const struct stage *stage, struct rig *rig, struct tracker_rig *tracking,
			 struct diag *diag)
{
	int err = load_rig(stage, rig, tracking, diag);

	if (err)
		return err;
	for (uint32_t i = 0; i < rig->camera_count; i++) {
		const struct view *view = &stage->rig.views[i];
		int size_err = rig_check_size(rig, i, view->width_px, view->height_px, diag);

		if (size_err)
			err = size_err;
	}
	if (err)
		rig_finish(rig);
	return err;
}

/* The layouts behind one another. */
static int load_layouts(struct stage *stage, struct diag *diag)
{
	static struct layout one; /* control thread only; too large for its stack */
	int first_err = 0;

	for (uint32_t i = 0; i < stage->config.layout_count; i++) {
		const char *path = stage->config.layout_paths[i];
		int err = layout_load(&one, path, diag);

		if (!err)
			err = layout_join(&stage->layout, &one, path, diag);
		if (!first_err)
			first_err = err;
	}
	return first_err;
}

/* Not even one that cannot be read. */
static bool is_missing(const char *rig_dir)
{
	struct stat st;

	return lstat(rig_dir, &st) < 0 && errno == ENOENT;
}

/* A station sees by its tracked cameras alone. */
static int check_roles(const struct stage *stage, struct diag *diag)
{
	const struct config *config = &stage->config;

	if (stage->ir_mask)
		return 0;
	diag_add(diag,
		 "%s:%d:%d: cameras: none has the role ir, so there is nothing to track: give one "
		 "that sees the markers role: ir",
		 config->path, config->cameras[0].line, config->cameras[0].column);
	return -EINVAL;
}

static int load(struct stage *stage, const char *config_path, bool to_calibrate,
		const struct config_drivers *drivers, struct diag *diag)
{
	memset(stage, 0, sizeof(*stage));
	int err = config_load_for(&stage->config, config_path, drivers, diag);
	if (err)
		return err;
	int layout_err = load_layouts(stage, diag);
	number_views(stage);
	int roles_err = check_roles(stage, diag);
	stage->has_rig = !to_calibrate || !is_missing(stage->config.rig_dir);
	int rig_err = stage->has_rig ? load_rig(stage, &stage->rig, &stage->tracking, diag) : 0;

	if (!stage->has_rig)
		strcpy(stage->rig.revision, "none");
	if (!layout_err)
		layout_err = roles_err;
	if (layout_err && !rig_err)
		rig_finish(&stage->rig);
	return layout_err ? layout_err : rig_err;
}

int stage_load(struct stage *stage, const char *config_path, struct diag *diag)
{
	return load(stage, config_path, false, NULL, diag);
}

int stage_load_for(struct stage *stage, const char *config_path,
		   const struct config_drivers *drivers, struct diag *diag)
{
	return load(stage, config_path, false, drivers, diag);
}

int stage_load_to_calibrate(struct stage *stage, const char *config_path, struct diag *diag)
{
	return load(stage, config_path, true, NULL, diag);
}

void stage_finish(struct stage *stage)
{
	rig_finish(&stage->rig);
	memset(stage, 0, sizeof(*stage));
}
