/*
 * Plays a scene shot by shot into directories that files: cameras read.
 */
#include "sim/record.h"

#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "sim/picture.h"
#include "sim/record_files.h"
#include "sim/truth_json.h"
#include "sim/world/scene_parts.h"

#define TRUTH_NAME "truth.jsonl"
#define LIVE_NAME "live.yaml"
#define SECONDS_MAX 3600.0
#define UNCERTAINTY_NS 1000
/* Faults with which there is no frame. */
#define KEPT_BACK                                                        \
	(SIM_FAULT_BIT(SIM_FAULT_DROP) | SIM_FAULT_BIT(SIM_FAULT_MISS) | \
	 SIM_FAULT_BIT(SIM_FAULT_FREEZE) | SIM_FAULT_BIT(SIM_FAULT_UNPLUG))
#define CSV_HEADER "shot,mid_exposure_ns,uncertainty_ns,file\n"

struct recording {
	const char *dir;
	struct sim_scene *scene;
	struct sim_picture *pictures[SIM_DEVICE_MAX];
	struct part_file tables[SIM_DEVICE_MAX], truth_file;
	struct sim_truth truth;
	struct diag *diag;
};

static uint32_t device_count(const struct recording *recording)
{
	return recording->scene->camera_count + recording->scene->hd_count;
}

static int begin_camera(struct recording *recording, uint32_t c)
{
	const char *name = recording->scene->cameras[c].name;
	struct part_file *table = &recording->tables[c];
	char path[PATH_MAX];
	int err = record_path(recording->diag, path, "%s/%s", recording->dir, name);

	if (!err)
		err = record_clear_images(path, recording->diag);
	if (!err)
		err = record_path(recording->diag, path, "%s/%s/frames.csv", recording->dir, name);
	if (!err)
		err = part_file_open(table, path, recording->diag);
	if (err)
		return err;
	fputs(CSV_HEADER, table->file); /* a failure shows when the file is finished */
	err = sim_picture_create(&recording->pictures[c], recording->scene, c, SIM_NOISE_FULL);
	return err ? record_fail(recording->diag, path, "render the images of", -err) : 0;
}

struct addresses {
	char text[SIM_DEVICE_MAX][NAME_BYTES + 8];
	const char *pointers[SIM_DEVICE_MAX];
};

static void make_addresses(struct addresses *out, const struct recording *recording,
			   const char *driver)
{
	for (uint32_t c = 0; c < device_count(recording); c++) {
		snprintf(out->text[c], sizeof(out->text[c]), "%s:%s", driver,
			 recording->scene->cameras[c].name);
		out->pointers[c] = out->text[c];
	}
}

/* The same cameras before the same actors, for the station to look at while they play. */
static int write_live(const struct recording *recording, const struct sim_options *options)
{
	const char *scene = options->scene && *options->scene ? options->scene : "talking";
	char path[PATH_MAX], extra[PATH_MAX + 80];
	struct addresses addresses;

	if (strchr(scene, '/') && realpath(scene, path))
		scene = path;
	snprintf(extra, sizeof(extra), "trigger: sim\nsim: {scene: \"%s\", seed: %" PRIu64 "}\n",
		 scene, options->seed);
	make_addresses(&addresses, recording, "sim");
	return sim_scene_write_config(recording->scene, recording->dir, LIVE_NAME,
				      addresses.pointers, extra, recording->diag);
}

/* A board has no layout to be tracked with. */
static int write_stage(const struct recording *recording, const struct sim_options *options)
{
	char path[PATH_MAX];
	struct addresses addresses;

	make_addresses(&addresses, recording, "files");
	int err = sim_scene_write_stage(recording->scene, recording->dir, addresses.pointers,
					"trigger: free", recording->diag);
	if (err || !recording->scene->script.board)
		return err ? err : write_live(recording, options);
	err = record_path(recording->diag, path, "%s/" LIVE_NAME, recording->dir);
	if (!err && unlink(path) < 0 && errno != ENOENT)
		err = record_fail(recording->diag, path, "remove", errno);
	return err;
}

static int begin(struct recording *recording, const struct sim_options *options)
{
	char path[PATH_MAX];
	int err = record_claim_dir(recording->dir, TRUTH_NAME, recording->diag);

	if (!err)
		err = record_path(recording->diag, path, "%s/" TRUTH_NAME, recording->dir);
	if (!err)
		err = part_file_open(&recording->truth_file, path, recording->diag);
	if (!err)
		err = write_stage(recording, options);
	for (uint32_t c = 0; !err && c < device_count(recording); c++)
		err = begin_camera(recording, c);
	return err;
}

static int write_image(const struct recording *recording, const char *path, const uint8_t *pixels,
		       int width_px, int height_px)
{
	size_t size_bytes = (size_t)width_px * (size_t)height_px;
	FILE *file = fopen(path, "w");

	if (!file)
		return record_fail(recording->diag, path, "write", errno);
	bool bad = fprintf(file, "P5\n%d %d\n255\n", width_px, height_px) < 0 ||
		   fwrite(pixels, 1, size_bytes, file) != size_bytes;
	int err = errno;

	if (fclose(file) != 0 && !bad) {
		bad = true;
		err = errno;
	}
	return bad ? record_fail(recording->diag, path, "write", err ? err : EIO) : 0;
}

static int64_t exposed_ns(const struct sim_scene *scene, uint32_t c, uint64_t shot)
{
	return c < scene->camera_count ? sim_scene_mid_exposure_ns(scene, shot)
				       : sim_scene_hd_mid_exposure_ns(scene, shot);
}

static sim_fault_mask faults_of(const struct sim_scene *scene, uint32_t c, uint64_t shot)
{
	int64_t period_ns = scene->period_ns * (c < scene->camera_count ? 1 : scene->hd_divider);

	return sim_faults_of(&scene->script.faults, scene->cameras[c].name,
			     exposed_ns(scene, c, shot), period_ns);
}

/* What the camera says of the time. */
static int64_t stamp_ns(const struct sim_scene *scene, uint32_t c, uint64_t shot,
			sim_fault_mask faults)
{
	const sim_fault_mask late =
		SIM_FAULT_BIT(SIM_FAULT_STAMP_SHIFT) | SIM_FAULT_BIT(SIM_FAULT_PHASE_SLIP);
	int64_t time_ns = exposed_ns(scene, c, shot);

	return time_ns + (faults & late ? scene->period_ns : 0) +
	       sim_faults_clock_off_ns(&scene->script.faults, scene->cameras[c].name, time_ns);
}

static int record_frame(struct recording *recording, uint32_t c, uint64_t shot)
{
	char path[PATH_MAX];
	int width_px, height_px;
	sim_fault_mask faults = faults_of(recording->scene, c, shot);

	if (faults & KEPT_BACK)
		return 0;
	const uint8_t *pixels =
		sim_picture_take(recording->pictures[c], shot, faults, true, &width_px, &height_px);
	int err = record_path(recording->diag, path, "%s/%s/%06llu.pgm", recording->dir,
			      recording->scene->cameras[c].name, (unsigned long long)shot);

	if (!err)
		err = write_image(recording, path, pixels, width_px, height_px);
	if (err)
		return err;
	if (fprintf(recording->tables[c].file, "%llu,%lld,%d,%06llu.pgm\n",
		    (unsigned long long)shot,
		    (long long)stamp_ns(recording->scene, c, shot, faults), UNCERTAINTY_NS,
		    (unsigned long long)shot) < 0)
		return record_fail(recording->diag, recording->tables[c].part_path, "write", errno);
	return 0;
}

static int record_shot(struct recording *recording, uint64_t shot)
{
	double time_s = (double)sim_scene_mid_exposure_ns(recording->scene, shot) * 1e-9;

	uint32_t count = shot % recording->scene->hd_divider == recording->scene->hd_phase
				 ? device_count(recording)
				 : recording->scene->camera_count;

	for (uint32_t c = 0; c < count; c++) {
		int err = record_frame(recording, c, shot);

		if (err)
			return err;
	}
	sim_scene_truth(recording->scene, time_s, &recording->truth);
	int err = truth_json_write(recording->scene, shot, &recording->truth,
				   recording->truth_file.file);
	if (err)
		return record_fail(recording->diag, recording->truth_file.part_path, "write",
				   err == -EIO && errno ? errno : -err);
	return 0;
}

static uint64_t shot_count(const struct sim_scene *scene, double seconds)
{
	double count = round(seconds * (double)NS_PER_S / (double)scene->period_ns);

	return count < 1 ? 1 : (uint64_t)count;
}

static int finish_files(struct recording *recording)
{
	int err = 0;

	for (uint32_t c = 0; !err && c < device_count(recording); c++)
		err = part_file_finish(&recording->tables[c], recording->diag);
	return err ? err : part_file_finish(&recording->truth_file, recording->diag);
}

static void recording_destroy(struct recording *recording)
{
	for (int c = 0; c < SIM_DEVICE_MAX; c++)
		sim_picture_destroy(recording->pictures[c]);
	for (int c = 0; c < SIM_DEVICE_MAX; c++) {
		if (recording->tables[c].file)
			fclose(recording->tables[c].file);
	}
	if (recording->truth_file.file)
		fclose(recording->truth_file.file);
	sim_scene_destroy(recording->scene);
	free(recording);
}

int sim_record(const struct sim_options *options, const char *dir, double seconds,
	       sim_progress_fn *progress, void *user, struct diag *diag)
{
	struct recording *recording;
	int err;

	if (!(seconds > 0 && seconds <= SECONDS_MAX)) {
		diag_add(diag, "sim: %g seconds: a recording has more than 0, up to %g", seconds,
			 SECONDS_MAX);
		return -EINVAL;
	}
	recording = calloc(1, sizeof(*recording));
	if (!recording)
		return record_fail(diag, dir, "record to", ENOMEM);
	recording->dir = dir;
	recording->diag = diag;
	err = sim_scene_create(&recording->scene, options, diag);
	if (!err)
		err = begin(recording, options);
	uint64_t count = err ? 0 : shot_count(recording->scene, seconds);

	for (uint64_t shot = 0; !err && shot < count; shot++) {
		err = record_shot(recording, shot);
		if (!err && progress)
			progress(shot + 1, count, user);
	}
	if (!err)
		err = finish_files(recording);
	recording_destroy(recording);
	return err;
}
