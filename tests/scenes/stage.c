/*
 * The scene's rig goes through files, as a station's does.
 */
#include "tests/scenes/stage.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

int stage_init(struct stage *stage, const struct sim_options *options)
{
	char dir[] = "/tmp/stage-play-XXXXXX", rig_dir[64], command[64];
	const char *addresses[CAMERA_MAX];
	char names[CAMERA_MAX][NAME_BYTES];
	struct diag diag = {0};

	if (!mkdtemp(dir) || sim_scene_create(&stage->scene, options, &diag))
		return -EINVAL;
	uint32_t count = sim_scene_camera_count(stage->scene);
	for (uint32_t c = 0; c < count; c++) {
		addresses[c] = "files:none";
		snprintf(names[c], NAME_BYTES, "%s", sim_scene_camera_name(stage->scene, c));
	}
	snprintf(rig_dir, sizeof(rig_dir), "%s/rig", dir);
	int error = sim_scene_write_stage(stage->scene, dir, addresses, NULL, &diag);
	if (!error)
		error = rig_load(&stage->rig, rig_dir, names, count, &diag);
	snprintf(command, sizeof(command), "rm -r %s", dir);
	if (system(command))
		error = -EIO;
	diag_print(&diag, stderr);
	diag_finish(&diag);
	stage->tracker_rig = (struct tracker_rig){.camera_count = count,
						  .layout = sim_scene_layout(stage->scene),
						  .settings = tracker_settings_default()};
	for (uint32_t c = 0; c < count; c++)
		stage->tracker_rig.views[c] = &stage->rig.views[c];
	tracker_state_init(&stage->state, stage->tracker_rig.layout);
	return error ? error : tracker_scratch_create(&stage->scratch);
}

void stage_finish(struct stage *stage)
{
	tracker_scratch_destroy(stage->scratch);
	rig_finish(&stage->rig);
	sim_scene_destroy(stage->scene);
}

static double thread_us(void)
{
	struct timespec t;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

double stage_play_us(struct stage *stage, const struct blob_play *play, uint64_t n,
		     uint32_t missing_mask)
{
	struct shot shot = {.number = n,
			    .mid_exposure_ns = sim_scene_mid_exposure_ns(stage->scene, n),
			    .camera_count = stage->tracker_rig.camera_count,
			    .missing_mask = missing_mask};

	sim_scene_truth(stage->scene, (double)shot.mid_exposure_ns * 1e-9, &stage->truth);
	for (uint32_t c = 0; c < shot.camera_count; c++) {
		if (missing_mask & (1u << c))
			continue;
		blob_play_camera(play, stage->scene, &stage->truth, n, c, &stage->sets[c]);
		shot.sets[c] = &stage->sets[c];
	}
	double before_us = thread_us();
	tracker_run(&stage->state, stage->scratch, &stage->tracker_rig, &shot, &stage->set);
	return thread_us() - before_us;
}
