/*
 * Cameras, sync and tracker over a recording.
 */
#include "ctl/replay.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/exit_codes.h"
#include "config/layout_file.h"
#include "ctl/program_drivers.h"
#include "ctl/recording.h"
#include "drivers/files/files.h"
#include "track/shot.h"
#include "track/sync/sync.h"

struct replay {
	struct stage stage;
	struct open_camera cameras[CAMERA_MAX];
	struct recording *recording;
	struct sync sync;
	struct tracker_state tracker;
	struct tracker_scratch *scratch;
	struct marker_set set;
	struct shot shot;
	uint32_t taken_mask; /* whose sets are still to be popped */
	struct replay_count count;
	struct {
		uint64_t count, first_shot;
		uint64_t first_seq; /* of the camera's frames */
	} off_time[CAMERA_MAX];
};

const struct stage *replay_stage(const struct replay *r)
{
	return &r->stage;
}

struct replay_count replay_count(const struct replay *r)
{
	return r->count;
}

static void note_off_time(struct replay *r, const struct sync_decision *decision,
			  const struct blob_set *const *sets)
{
	for (uint32_t left = decision->off_time_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		if (r->off_time[c].count++)
			continue;
		r->off_time[c].first_shot = decision->shot;
		r->off_time[c].first_seq = sets[c]->device_seq;
	}
}

static void track_shot(struct replay *r, const struct sync_decision *decision,
		       const struct blob_set *const *sets)
{
	shot_gather(&r->shot, decision, sets, r->stage.config.camera_count, r->stage.ir_mask);
	tracker_run(&r->tracker, r->scratch, &r->stage.tracking, &r->shot, &r->set);
	r->count.shots++;
	r->count.incomplete += r->shot.missing_mask != 0;
}

/* Every camera has shown its front or has ended, so sync never needs to wait. */
static enum sync_result next_result(struct replay *r)
{
	uint32_t camera_count = r->stage.config.camera_count;
	const struct blob_set *sets[CAMERA_MAX];
	struct front fronts[CAMERA_MAX];
	struct sync_decision decision;

	for (uint32_t c = 0; c < camera_count; c++) {
		if (r->taken_mask >> c & 1)
			recording_pop(r->recording, c);
		sets[c] = recording_peek(r->recording, c);
		fronts[c] = front_of_queue(sets[c], true);
	}
	enum sync_result result = sync_next(&r->sync, fronts, camera_count, NULL, false, &decision);
	if (result == SYNC_SHOT) {
		note_off_time(r, &decision, sets);
		track_shot(r, &decision, sets);
	}
	r->taken_mask = decision.member_mask | decision.stale_mask;
	r->count.stale += (uint64_t)__builtin_popcount(decision.stale_mask);
	return result;
}

const struct shot *replay_shot(const struct replay *r)
{
	return &r->shot;
}

const struct marker_set *replay_next(struct replay *r)
{
	enum sync_result result;

	do {
		result = next_result(r);
	} while (result != SYNC_SHOT && result != SYNC_END);
	return result == SYNC_SHOT ? &r->set : NULL;
}

/* Opens everything; returns an exit code. */
static int prepare(struct replay *r, const char *config_path, const char *layout_path,
		   uint64_t threads, struct diag *diag)
{
	int err = stage_load(&r->stage, config_path, diag);

	if (!err && layout_path)
		err = layout_load(&r->stage.layout, layout_path, diag);
	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	err = open_cameras(r->cameras, &r->stage, r->stage.ir_mask, recording_drivers, 0, diag);
	if (err)
		return err == -ENOMEM ? EXIT_CODE_INTERNAL : EXIT_CODE_BAD_INPUT;
	if (tracker_scratch_create(&r->scratch) < 0) {
		diag_add(diag, "out of memory");
		return EXIT_CODE_INTERNAL;
	}
	r->sync.period_ns = open_cameras_period_ns(r->cameras, r->stage.ir_mask);
	tracker_state_init(&r->tracker, &r->stage.layout);
	err = recording_open(&r->recording, &r->stage, r->cameras, (uint32_t)threads, diag);
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

int replay_open(struct replay **out, const char *config_path, const char *layout_path,
		uint64_t threads, struct diag *diag)
{
	struct replay *r = calloc(1, sizeof(*r));
	int code = r ? prepare(r, config_path, layout_path, threads, diag) : EXIT_CODE_INTERNAL;

	if (code == EXIT_CODE_OK)
		*out = r;
	else
		replay_close(r);
	return code;
}

void replay_close(struct replay *r)
{
	if (!r)
		return;
	recording_close(r->recording);
	close_cameras(r->cameras, r->stage.config.camera_count);
	tracker_scratch_destroy(r->scratch);
	stage_finish(&r->stage);
	free(r);
}

static const char *first_problem(const struct open_camera *camera)
{
	const char *problem = files_camera_problem(camera->camera);

	return problem[0] ? problem : "an image of another size than the first";
}

static void report_camera(const struct replay *r, uint32_t camera, struct diag *diag)
{
	const struct config_camera *named = &r->stage.config.cameras[camera];
	struct recording_losses losses = recording_losses(r->recording, camera);

	if (losses.damaged)
		diag_add(diag,
			 "camera %s: %" PRIu64 " of %" PRIu64 " images are damaged, and the camera "
			 "is missing from their shots; the first: %s",
			 named->name, losses.damaged, losses.damaged + losses.frames,
			 first_problem(&r->cameras[camera]));
	if (r->off_time[camera].count)
		diag_add(diag,
			 "camera %s: in %" PRIu64 " shots its time is more than half a period from "
			 "the other cameras', first in shot %" PRIu64 " (%s/frames.csv:%d): the "
			 "times of these shots are the others'; mend its mid_exposure_ns or its "
			 "shot numbers",
			 named->name, r->off_time[camera].count, r->off_time[camera].first_shot,
			 named->address + strlen("files:"),
			 files_camera_line(r->cameras[camera].camera,
					   r->off_time[camera].first_seq));
	if (losses.error)
		diag_add(diag, "camera %s: %s: reading ended early: %s", named->name,
			 named->address, strerror(-losses.error));
	if (losses.blobs_lost)
		fprintf(stderr,
			"camera %s: %" PRIu64 " spots beyond %d in an image were left out\n",
			named->name, losses.blobs_lost, BLOB_MAX);
}

void replay_report(const struct replay *r, struct diag *diag)
{
	for (uint32_t c = 0; c < r->stage.config.camera_count; c++)
		report_camera(r, c, diag);
}
