/*
 * Scene, tracker, aim check and ledger, shot by shot.
 */
#include "aim_play.h"

#include <math.h>
#include <string.h>

#define FORGOTTEN_S 1.8 /* all blocks of the check, and one more */

int aim_play_init(struct aim_play *aim, const char *scene, uint64_t seed, uint32_t camera_count)
{
	const struct sim_options options = {
		.scene = scene, .seed = seed, .camera_count = camera_count};

	memset(&aim->check, 0, sizeof(aim->check));
	aim->shot = 0;
	int err = sim_play_init(&aim->play, &options, NULL);
	if (!err)
		ledger_init(&aim->ledger, sim_scene_period_ns(aim->play.scene));
	return err;
}

void aim_play_finish(struct aim_play *aim)
{
	sim_play_finish(&aim->play);
}

double aim_play_rate_hz(const struct aim_play *aim)
{
	return 1e9 / (double)sim_scene_period_ns(aim->play.scene);
}

void aim_play_shot(struct aim_play *aim)
{
	const struct blob_play blobs = {0};
	struct sim_play *play = &aim->play;
	uint64_t n = aim->shot++;

	sim_play_shot_us(play, &blobs, n, 0);
	struct shot shot = {.number = n,
			    .mid_exposure_ns = sim_scene_mid_exposure_ns(play->scene, n),
			    .camera_count = play->rig.camera_count};
	for (uint32_t c = 0; c < shot.camera_count; c++)
		shot.sets[c] = play->set.missing_mask >> c & 1 ? NULL : &play->sets[c];
	if (!aim_check_run(&aim->check, &play->tracker_rig, &shot, &play->set))
		return;
	for (uint32_t c = 0; c < shot.camera_count; c++)
		ledger_note_aim(&aim->ledger, c, n, aim->check.aims[c].shift_px,
				aim->check.aims[c].turn_mrad);
}

void aim_play_seconds(struct aim_play *aim, double seconds)
{
	for (int64_t n = lround(seconds * aim_play_rate_hz(aim)); n > 0; n--)
		aim_play_shot(aim);
}

static void set_pose(struct view *view, struct pose rt_cam_stage)
{
	struct pose rt_stage_cam = pose_inverse(&rt_cam_stage);

	view->rt_cam_stage = rt_cam_stage;
	view->centre_stage_m = rt_stage_cam.t;
}

void aim_play_move(struct aim_play *aim, uint32_t camera, struct vec3 turn_rad, struct vec3 shift_m)
{
	struct view *view = &aim->play.rig.views[camera];
	struct pose by = pose_from_rotation_vector(turn_rad);

	by.t = shift_m;
	set_pose(view, pose_compose(&by, &view->rt_cam_stage));
}

static bool find_named(const struct aim_play *aim, const uint64_t *before, uint32_t *camera)
{
	for (uint32_t c = 0; c < aim->play.rig.camera_count; c++)
		if (aim->ledger.cameras[c].counts[LEDGER_MOVED] > before[c]) {
			*camera = c;
			return true;
		}
	return false;
}

double aim_play_until_named(struct aim_play *aim, double seconds, uint32_t *camera)
{
	int64_t shots = lround(seconds * aim_play_rate_hz(aim));
	uint64_t before[CAMERA_MAX];

	for (uint32_t c = 0; c < CAMERA_MAX; c++)
		before[c] = aim->ledger.cameras[c].counts[LEDGER_MOVED];
	for (int64_t n = 1; n <= shots; n++) {
		aim_play_shot(aim);
		if (find_named(aim, before, camera))
			return (double)n / aim_play_rate_hz(aim);
	}
	return NAN;
}

void aim_play_put_back(struct aim_play *aim, uint32_t camera, struct pose before)
{
	set_pose(&aim->play.rig.views[camera], before);
	aim_play_seconds(aim, FORGOTTEN_S);
}
