/*
 * Loads config, then layout and rig, and numbers the tracked cameras.
 */
#include "config/stage.h"

#include <string.h>

#include "config/layout_file.h"

/* The rig holds the tracked cameras alone: nobody needs to calibrate one that is only recorded. */
static int load_rig(struct stage *stage, struct diag *diag)
{
	const struct config *config = &stage->config;
	char names[CAMERA_MAX][NAME_BYTES];
	uint32_t count = 0;

	stage->tracking.camera_count = config->camera_count;
	for (uint32_t c = 0; c < config->camera_count; c++) {
		stage->view_index[c] = VIEW_NONE;
		if (config->cameras[c].role != ROLE_IR)
			continue;
		memcpy(names[count], config->cameras[c].name, NAME_BYTES);
		stage->ir_mask |= UINT32_C(1) << c;
		stage->tracking.views[c] = &stage->rig.views[count];
		stage->view_index[c] = count++;
	}
	return rig_load(&stage->rig, config->rig_dir, names, count, diag);
}

int stage_load(struct stage *stage, const char *config_path, struct diag *diag)
{
	memset(stage, 0, sizeof(*stage));
	int err = config_load(&stage->config, config_path, diag);
	if (err)
		return err;
	int layout_err = layout_load(&stage->layout, stage->config.layout_path, diag);
	int rig_err = load_rig(stage, diag);

	if (layout_err && !rig_err)
		rig_finish(&stage->rig);
	if (layout_err || rig_err)
		return layout_err ? layout_err : rig_err;
	stage->tracking.layout = &stage->layout;
	stage->tracking.settings = stage->config.tracking;
	return 0;
}

void stage_finish(struct stage *stage)
{
	rig_finish(&stage->rig);
	memset(stage, 0, sizeof(*stage));
}
