/*
 * The share of a shot's motion is fitted by least squares over markers and shots, per camera.
 */
#include "track/sync/step_check.h"

#include <stddef.h>

#define MOTION_MIN_PX 0.3  /* less is noise */
#define MOTION_MAX_PX 20.0 /* more may meet another marker's blob */
#define REACH_MIN_PX 1.0
#define ENOUGH_PX2 300.0 /* of motion squared, until it is told */

static const struct blob *nearest_blob(const struct blob_set *set, const double pixel[2],
				       double reach_px)
{
	const struct blob *nearest = NULL;
	double least_px2 = reach_px * reach_px;

	for (uint32_t b = 0; b < set->blob_count; b++) {
		double x_px = set->blobs[b].x_px - pixel[0], y_px = set->blobs[b].y_px - pixel[1];
		double apart_px2 = x_px * x_px + y_px * y_px;

		if (apart_px2 < least_px2) {
			least_px2 = apart_px2;
			nearest = &set->blobs[b];
		}
	}
	return nearest;
}

static void add_marker(struct step_check *check, uint32_t camera, const struct view *view,
		       const struct blob_set *set, struct vec3 last_m, struct vec3 now_m)
{
	double last[2], now[2];

	if (!view_project(view, last_m, last, NULL) || !view_project(view, now_m, now, NULL))
		return;
	double x_px = now[0] - last[0], y_px = now[1] - last[1];
	double motion_px2 = x_px * x_px + y_px * y_px;

	if (motion_px2 < MOTION_MIN_PX * MOTION_MIN_PX ||
	    motion_px2 > MOTION_MAX_PX * MOTION_MAX_PX)
		return;
	const struct blob *blob = nearest_blob(set, now, REACH_MIN_PX + 1.5 * sqrt(motion_px2));
	if (!blob)
		return;
	check->cameras[camera].along_px2 +=
		(blob->x_px - now[0]) * x_px + (blob->y_px - now[1]) * y_px;
	check->cameras[camera].motion_px2 += motion_px2;
}

/* Tells once there is enough, and keeps half of it. */
static bool tell(struct step_check *check, uint32_t camera, double *off_shots)
{
	double motion_px2 = check->cameras[camera].motion_px2;

	if (motion_px2 < ENOUGH_PX2)
		return false;
	*off_shots = check->cameras[camera].along_px2 / motion_px2;
	check->cameras[camera].along_px2 /= 2;
	check->cameras[camera].motion_px2 /= 2;
	return true;
}

static bool take_turn(struct step_check *check, const struct tracker_rig *rig,
		      const struct shot *shot, const struct marker_set *set, uint32_t *camera,
		      double *off_shots)
{
	uint32_t c = check->turn % rig->camera_count;

	check->turn = c + 1;
	if (!rig->views[c] || !shot->sets[c])
		return false;
	for (uint32_t i = 0; i < set->label_count; i++)
		if (check->seen[i] && set->markers[i].status == MARKER_MEASURED)
			add_marker(check, c, rig->views[c], shot->sets[c], check->last_m[i],
				   set->markers[i].p_stage_m);
	*camera = c;
	return tell(check, c, off_shots);
}

bool step_check_run(struct step_check *check, const struct tracker_rig *rig,
		    const struct shot *shot, const struct marker_set *set, uint32_t *camera,
		    double *off_shots)
{
	bool told = check->has_last && shot->number == check->last_shot + 1 &&
		    take_turn(check, rig, shot, set, camera, off_shots);

	for (uint32_t i = 0; i < set->label_count; i++) {
		check->seen[i] = set->markers[i].status == MARKER_MEASURED;
		check->last_m[i] = set->markers[i].p_stage_m;
	}
	check->has_last = true;
	check->last_shot = shot->number;
	return told;
}
