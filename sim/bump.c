/*
 * Bumped cameras: where they look from then on. The rig of the station does not know.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/rng.h"
#include "sim/faults.h"
#include "sim/world/scene_parts.h"

/* Turns about an axis across its line of sight. */
static void turn(struct sim_camera *camera, double angle_mrad, struct rng *rng)
{
	double way_rad = 2 * M_PI * rng_uniform(rng), angle_rad = 1e-3 * angle_mrad;
	struct pose by = pose_from_rotation_vector(
		(struct vec3){angle_rad * cos(way_rad), angle_rad * sin(way_rad), 0});

	camera->rt_cam_stage = pose_compose(&by, &camera->rt_cam_stage);
}

static uint32_t count_bumps(const struct sim_faults *faults)
{
	uint32_t count = 0;

	for (uint32_t i = 0; i < faults->count; i++)
		count += faults->faults[i].kind == SIM_FAULT_BUMP;
	return count;
}

/* The camera of that name, as bumps before have left it; NULL: the scene has none. */
static const struct sim_camera *find(const struct sim_scene *scene, const char *name,
				     uint32_t *index)
{
	const struct sim_camera *found = NULL;

	for (uint32_t c = 0; c < scene->camera_count + scene->hd_count; c++)
		if (strcmp(scene->cameras[c].name, name) == 0) {
			found = &scene->cameras[c];
			*index = c;
		}
	for (uint32_t b = 0; found && b < scene->bump_count; b++)
		if (scene->bumps[b].camera == *index)
			found = &scene->bumps[b].bumped;
	return found;
}

int scene_bump_cameras(struct sim_scene *scene)
{
	const struct sim_faults *faults = &scene->script.faults;
	uint32_t count = count_bumps(faults), camera;
	struct rng rng;

	scene->bumps = count ? calloc(count, sizeof(*scene->bumps)) : NULL;
	if (count && !scene->bumps)
		return -ENOMEM;
	rng_init(&rng, scene->seed, 6);
	for (uint32_t i = 0; i < faults->count; i++) {
		const struct sim_fault *fault = &faults->faults[i];
		const struct sim_camera *before =
			fault->kind == SIM_FAULT_BUMP ? find(scene, fault->device, &camera) : NULL;
		struct scene_bump *bump = &scene->bumps[scene->bump_count];

		if (!before)
			continue;
		*bump = (struct scene_bump){fault, camera, *before};
		turn(&bump->bumped, fault->angle_mrad, &rng);
		scene->bump_count++;
	}
	return 0;
}

const struct sim_camera *scene_camera_at(const struct sim_scene *scene, uint32_t camera,
					 double time_s)
{
	const struct sim_camera *now = &scene->cameras[camera];

	for (uint32_t b = 0; b < scene->bump_count; b++) {
		const struct scene_bump *bump = &scene->bumps[b];
		double since_s = time_s - bump->fault->at_s;

		if (bump->camera == camera && since_s >= 0 &&
		    (bump->fault->for_s <= 0 || since_s < bump->fault->for_s))
			now = &bump->bumped;
	}
	return now;
}
