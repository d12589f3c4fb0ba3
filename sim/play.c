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

#include "sim/faults.h"

#define PATIENCE_SHOTS 3 /* as the station's: then a shot is closed */

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

int sim_play_use_pixels(struct sim_play *play, enum sim_noise noise, struct diag *diag)
{
	struct blob_settings settings = blob_settings_default();
	int err = 0;

	settings.electrons_per_grey = sim_picture_electrons_per_grey(play->scene);

	for (uint32_t c = 0; !err && c < play->rig.camera_count; c++) {
		const struct view *view = &play->rig.views[c];

		err = sim_picture_create(&play->pictures[c], play->scene, c, noise);
		if (!err)
			err = blob_finder_create(&play->finders[c], view->width_px, view->height_px,
						 &settings);
	}
	if (err)
		diag_add(diag, "sim: pictures of %u cameras: %s", play->rig.camera_count,
			 strerror(-err));
	return err;
}

void sim_play_finish(struct sim_play *play)
{
	for (int c = 0; c < SIM_CAMERA_MAX; c++) {
		sim_picture_destroy(play->pictures[c]);
		blob_finder_destroy(play->finders[c]);
		play->pictures[c] = NULL;
		play->finders[c] = NULL;
	}
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

static void find_blobs(struct sim_play *play, uint64_t shot, uint32_t c, sim_fault_mask faults)
{
	struct blob_set *set = &play->sets[c];
	struct grey_image image;

	image.pixels = sim_picture_take(play->pictures[c], shot, faults, true, &image.width_px,
					&image.height_px);
	image.stride_bytes = image.width_px;
	image.bits = 8;
	set->shot = set->device_seq = shot;
	set->mid_exposure_ns = sim_scene_mid_exposure_ns(play->scene, shot);
	set->uncertainty_ns = 1000;
	blob_finder_run(play->finders[c], &image, set);
}

static double time_s(const struct sim_scene *scene, uint64_t shot)
{
	return (double)sim_scene_mid_exposure_ns(scene, shot) * 1e-9;
}

static void make_blobs(struct sim_play *play, const struct blob_play *blobs, uint64_t shot,
		       uint32_t c, sim_fault_mask faults)
{
	bool is_old = shot > 0 && faults & SIM_FAULT_BIT(SIM_FAULT_SHIFT);

	if (is_old)
		sim_scene_truth(play->scene, time_s(play->scene, shot - 1), &play->before);
	blob_play_camera(blobs, play->scene, is_old ? &play->before : &play->truth, shot, c,
			 &play->sets[c]);
	blob_play_fault(&play->sets[c], faults);
}

/* A frame that would not be there, or too late. */
static bool is_kept_back(const struct sim_play *play, uint32_t c, int64_t time_ns,
			 sim_fault_mask faults)
{
	const sim_fault_mask gone = SIM_FAULT_BIT(SIM_FAULT_DROP) | SIM_FAULT_BIT(SIM_FAULT_MISS) |
				    SIM_FAULT_BIT(SIM_FAULT_FREEZE) |
				    SIM_FAULT_BIT(SIM_FAULT_UNPLUG);
	int64_t delay_ns = sim_faults_delay_ns(&sim_scene_script(play->scene)->faults,
					       sim_scene_camera_name(play->scene, c), time_ns);

	return faults & gone || delay_ns > PATIENCE_SHOTS * sim_scene_period_ns(play->scene);
}

static void fill_sets(struct sim_play *play, const struct blob_play *blobs, struct shot *shot)
{
	const struct sim_scene *scene = play->scene;

	for (uint32_t c = 0; c < shot->camera_count; c++) {
		sim_fault_mask faults = sim_faults_of(
			&sim_scene_script(scene)->faults, sim_scene_camera_name(scene, c),
			shot->mid_exposure_ns, sim_scene_period_ns(scene));

		if (is_kept_back(play, c, shot->mid_exposure_ns, faults))
			shot->missing_mask |= UINT32_C(1) << c;
		if (shot->missing_mask & (UINT32_C(1) << c))
			continue;
		if (play->pictures[c])
			find_blobs(play, shot->number, c, faults);
		else
			make_blobs(play, blobs, shot->number, c, faults);
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

	sim_scene_truth(play->scene, time_s(play->scene, n), &play->truth);
	double truth_us = thread_us();
	fill_sets(play, blobs, &shot);
	double blobs_us = thread_us();
	tracker_run(&play->state, play->scratch, &play->tracker_rig, &shot, &play->set);
	double tracker_us = thread_us() - blobs_us;
	play->cost.truth_us += truth_us - begin_us;
	play->cost.blobs_us += blobs_us - truth_us;
	play->cost.tracker_us += tracker_us;
	return tracker_us;
}
