/*
 * The scene's rig goes through files, as a station's does.
 */
#include "sim/play.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Removes what sim_scene_write_stage made. */
static void remove_stage(const struct sim_scene *scene, const char *dir)
{
	uint32_t count = sim_scene_camera_count(scene) + sim_scene_hd_count(scene);
	char path[PATH_MAX];

	for (uint32_t c = 0; c < count; c++) {
		snprintf(path, sizeof(path), "%s/rig/%s.cameramodel", dir,
			 sim_scene_camera_name(scene, c));
		unlink(path);
	}
	for (int i = 0; i < 4; i++) {
		static const char *const names[] = {"/rig", "/layout.yaml", "/stage.yaml", ""};

		snprintf(path, sizeof(path), "%s%s", dir, names[i]);
		remove(path);
	}
}

static int load_rig(struct rig *rig, const struct sim_scene *scene, const char *dir,
		    struct diag *diag)
{
	uint32_t count = sim_scene_camera_count(scene);
	const char *addresses[SIM_DEVICE_MAX];
	char names[CAMERA_MAX][NAME_BYTES], rig_dir[PATH_MAX];

	for (int c = 0; c < SIM_DEVICE_MAX; c++)
		addresses[c] = "files:none";
	for (uint32_t c = 0; c < count; c++)
		snprintf(names[c], NAME_BYTES, "%s", sim_scene_camera_name(scene, c));
	int err = sim_scene_write_stage(scene, dir, addresses, NULL, diag);

	if (err)
		return err;
	snprintf(rig_dir, sizeof(rig_dir), "%s/rig", dir);
	return rig_load(rig, rig_dir, names, count, diag);
}

static int make_rig(struct rig *rig, const struct sim_scene *scene, struct diag *diag)
{
	char dir[] = "/tmp/stage-play-XXXXXX";

	if (!mkdtemp(dir)) {
		int err = errno;

		diag_add(diag, "%s: cannot make the directory: %s", dir, strerror(err));
		return -err;
	}
	int err = load_rig(rig, scene, dir, diag);

	remove_stage(scene, dir);
	return err;
}

int sim_play_init(struct sim_play *play, const struct sim_options *options, struct diag *diag)
{
	memset(play, 0, sizeof(*play));
	int err = sim_scene_create(&play->scene, options, diag);

	if (!err)
		err = make_rig(&play->rig, play->scene, diag);
	if (!err)
		err = tracker_scratch_create(&play->scratch);
	if (err) {
		sim_play_finish(play);
		return err;
	}
	play->tracker_rig = (struct tracker_rig){.camera_count = play->rig.camera_count,
						 .layout = sim_scene_layout(play->scene),
						 .settings = tracker_settings_default()};
	for (uint32_t c = 0; c < play->rig.camera_count; c++)
		play->tracker_rig.views[c] = &play->rig.views[c];
	tracker_state_init(&play->state, play->tracker_rig.layout);
	return 0;
}

void sim_play_finish(struct sim_play *play)
{
	tracker_scratch_destroy(play->scratch);
	rig_finish(&play->rig);
	sim_scene_destroy(play->scene);
	play->scratch = NULL;
	play->scene = NULL;
}

static double thread_us(void)
{
	struct timespec t;

	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
	return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static void fill_blobs(struct sim_play *play, const struct blob_play *blobs, struct shot *shot)
{
	for (uint32_t c = 0; c < shot->camera_count; c++) {
		if (shot->missing_mask & (UINT32_C(1) << c))
			continue;
		blob_play_camera(blobs, play->scene, &play->truth, shot->number, c, &play->sets[c]);
		shot->sets[c] = &play->sets[c];
	}
}

double sim_play_shot_us(struct sim_play *play, const struct blob_play *blobs, uint64_t n,
			uint32_t missing_mask)
{
	struct shot shot = {.number = n,
			    .mid_exposure_ns = sim_scene_mid_exposure_ns(play->scene, n),
			    .camera_count = play->tracker_rig.camera_count,
			    .missing_mask = missing_mask};
	double begin_us = thread_us();

	sim_scene_truth(play->scene, (double)shot.mid_exposure_ns * 1e-9, &play->truth);
	double truth_us = thread_us();
	fill_blobs(play, blobs, &shot);
	double blobs_us = thread_us();
	tracker_run(&play->state, play->scratch, &play->tracker_rig, &shot, &play->set);
	double tracker_us = thread_us() - blobs_us;
	play->cost.truth_us += truth_us - begin_us;
	play->cost.blobs_us += blobs_us - truth_us;
	play->cost.tracker_us += tracker_us;
	return tracker_us;
}
