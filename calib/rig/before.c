/*
 * Cameras are matched by name.
 */
#include "calib/rig/before.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calib/board/sight.h"
#include "calib/rt.h"
#include "track/rigid.h"

int rig_before(struct rig *before, const char *dir, const struct observations *observations)
{
	struct rig made = {0}, *one = calloc(1, sizeof(*one));
	char path[PATH_MAX];

	if (!one)
		return -ENOMEM;
	for (uint32_t c = 0; c < observations->camera_count; c++) {
		const char *name = observations->cameras[c].name;
		char names[1][NAME_BYTES];

		memcpy(names[0], name, NAME_BYTES);
		if (snprintf(path, sizeof(path), "%s/%s.cameramodel", dir, name) >= PATH_MAX ||
		    access(path, F_OK) ||
		    rig_load(one, dir, (const char(*)[NAME_BYTES])names, 1, NULL))
			continue;
		made.views[made.camera_count] = one->views[0]; /* owned from now on */
		memcpy(made.names[made.camera_count++], name, NAME_BYTES);
	}
	free(one);
	*before = made;
	return 0;
}

/* NULL: it was not there. */
static const struct view *find_view(const struct rig *before, const char *name)
{
	for (uint32_t i = 0; i < before->camera_count; i++)
		if (!strcmp(before->names[i], name))
			return &before->views[i];
	return NULL;
}

int rig_before_check_sizes(const struct rig *before, const char *dir,
			   const struct observations *observations, struct diag *diag)
{
	int err = 0;

	for (uint32_t c = 0; c < observations->camera_count; c++) {
		const struct observed_camera *camera = &observations->cameras[c];
		const struct view *view = find_view(before, camera->name);

		if (!view ||
		    (view->width_px == camera->width_px && view->height_px == camera->height_px))
			continue;
		diag_add(diag,
			 "camera %s: its pictures are %dx%d, but %s was made for %dx%d; record the "
			 "board at the size at which the station runs; if that was changed on "
			 "purpose, write to a new rig with --out",
			 camera->name, camera->width_px, camera->height_px, dir, view->width_px,
			 view->height_px);
		err = -EINVAL;
	}
	return err;
}

static struct pose pose_of(const struct solution *solution, uint32_t camera)
{
	return pose_from_rt(solution->rt_cam_ref[camera]);
}

static struct pose find_frame(const struct rig *before, const struct observations *observations,
			      const struct solution *solution)
{
	struct rigid_pair pairs[CAMERA_MAX];
	struct pose frame = POSE_IDENTITY;
	int count = 0;

	for (uint32_t c = 0; c < observations->camera_count; c++) {
		const struct view *view = find_view(before, observations->cameras[c].name);

		if (!view)
			continue;
		if (count == 0) {
			struct pose rt_cam_ref = pose_of(solution, c);
			struct pose rt_stage_cam = pose_inverse(&view->rt_cam_stage);

			frame = pose_compose(&rt_stage_cam, &rt_cam_ref);
		}
		pairs[count++] = (struct rigid_pair){solution_centre_m(solution, c),
						     view->centre_stage_m, 1};
	}
	if (count >= 3)
		rigid_fit(pairs, count, &frame); /* on one line: the first camera's frame stays */
	return frame;
}

struct pose rig_before_frame(const struct rig *before, const struct observations *observations,
			     const struct solution *solution, struct camera_move *moves)
{
	struct pose rt_stage_ref = find_frame(before, observations, solution);

	for (uint32_t c = 0; c < observations->camera_count; c++) {
		const struct view *view = find_view(before, observations->cameras[c].name);

		moves[c] = (struct camera_move){.known = view != NULL};
		if (!view)
			continue;
		struct pose rt_cam_ref = pose_of(solution, c);
		struct pose rt_ref_cam = pose_inverse(&rt_cam_ref);
		struct pose rt_stage_cam = pose_compose(&rt_stage_ref, &rt_ref_cam);
		struct pose turned = pose_compose(&view->rt_cam_stage, &rt_stage_cam);
		moves[c].moved_mm = 1e3 * vec3_distance(rt_stage_cam.t, view->centre_stage_m);
		moves[c].turned_mrad = 1e3 * vec3_norm(pose_to_rotation_vector(&turned));
	}
	return rt_stage_ref;
}
