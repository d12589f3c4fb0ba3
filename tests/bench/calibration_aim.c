/*
 * Cameras that are bumped, one after the other, by 0.2 mrad about two axes; and scenes in which
 * nobody is.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>

#include "../unit/aim_play.h"
#include "calibration_parts.h"

#define BUMP_RAD 0.2e-3
#define GIVE_UP_S 6
#define WRONG_S 60 /* another camera was named, or nobody */

/* The worst over all cameras. */
static int bump_all(struct aim_play *aim, const char *scene, uint64_t seed, uint32_t cameras,
		    double *worst_s)
{
	int err = aim_play_init(aim, scene, seed, cameras);

	if (err)
		return err;
	aim_play_seconds(aim, 1.5);
	for (uint32_t c = 0; c < aim->play.rig.camera_count; c++)
		for (int axis = 0; axis < 2; axis++) {
			struct pose before = aim->play.rig.views[c].rt_cam_stage;
			const struct vec3 turn = {axis ? 0 : BUMP_RAD, axis ? BUMP_RAD : 0, 0};
			uint32_t named = UINT32_MAX;

			aim_play_seconds(aim, 0.083 * ((2 * c + (uint32_t)axis) % 4));
			aim_play_move(aim, c, turn, (struct vec3){0});
			double after_s = aim_play_until_named(aim, GIVE_UP_S, &named);
			*worst_s =
				fmax(*worst_s, named == c && isfinite(after_s) ? after_s : WRONG_S);
			aim_play_put_back(aim, c, before);
		}
	aim_play_finish(aim);
	return 0;
}

static int measure_bumps(struct aim_play *aim, json_t *figures, uint64_t seed)
{
	static const uint32_t CAMERAS[] = {4, 6, 8, 11};
	double face_s = 0, room_s = 0;
	int err = 0;

	for (uint32_t i = 0; !err && i < 4; i++)
		err = bump_all(aim, "talking", seed + i, CAMERAS[i], &face_s);
	if (!err)
		err = bump_all(aim, "four-actors", seed, 0, &room_s);
	if (err)
		return err;
	json_object_set_new(figures, "bump_named_worst_s", json_real(fmax(face_s, room_s)));
	json_object_set_new(figures, "bump_named_face_s", json_real(face_s));
	json_object_set_new(figures, "bump_named_room_s", json_real(room_s));
	return 0;
}

static int count_alarms(struct aim_play *aim, const char *scene, uint64_t seed, double seconds,
			uint32_t *alarms, double *most_px)
{
	int err = aim_play_init(aim, scene, seed, 0);

	if (err)
		return err;
	for (int64_t n = lround(seconds * aim_play_rate_hz(aim)); n > 0; n--) {
		aim_play_shot(aim);
		for (uint32_t c = 0; c < aim->play.rig.camera_count; c++)
			*most_px = fmax(*most_px, aim->check.aims[c].shift_px);
	}
	for (uint32_t c = 0; c < aim->play.rig.camera_count; c++)
		*alarms += (uint32_t)aim->ledger.cameras[c].counts[LEDGER_MOVED];
	aim_play_finish(aim);
	return 0;
}

int measure_aim(json_t *figures, uint64_t seed, double minutes)
{
	static const char *const SCENES[] = {"07-seventeen-minutes", "01-lips-and-lids",
					     "02-hidden", "04-head-shake", "11-body-and-face"};
	struct aim_play *aim = calloc(1, sizeof(*aim));
	int err = aim ? measure_bumps(aim, figures, seed) : -ENOMEM;
	uint32_t alarms = 0;
	double most_px = 0;

	for (uint64_t s = 0; !err && s < sizeof(SCENES) / sizeof(*SCENES); s++)
		err = count_alarms(aim, SCENES[s], seed + s, 60 * minutes, &alarms, &most_px);
	free(aim);
	if (err)
		return err;
	json_object_set_new(figures, "bump_false_alarms", json_real(alarms));
	json_object_set_new(figures, "bump_quiet_minutes", json_real(5 * minutes));
	json_object_set_new(figures, "bump_quiet_most_px", json_real(most_px));
	return 0;
}
