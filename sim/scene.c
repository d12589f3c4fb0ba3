/*
 * Puts face, motion and cameras together and answers what is where and who sees it.
 */
#include "sim/scene.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "sim/scene_file.h"
#include "sim/scene_parts.h"
#include "sim/world_parts.h"

#define DEFAULT_HD_DIVIDER 4
#define FACING_MIN 0.20    /* cosine; a flat disc shines back up to about 78 degrees */
#define STAND_OFF_M 0.5e-3 /* a disc lies on the skin, not in it */

int sim_scene_create(struct sim_scene **out, const struct sim_options *options, struct diag *diag)
{
	struct sim_scene *scene = calloc(1, sizeof(*scene));

	if (!scene)
		return -ENOMEM;
	int err = sim_script_load(&scene->script, options, diag);

	if (err) {
		free(scene);
		return err;
	}
	motion_init(&scene->actors[0].motion, scene->script.actors[0].performance, options->seed);
	scene->seed = options->seed;
	scene->rate_hz = scene->script.rate_hz;
	scene->period_ns = llround((double)NS_PER_S / scene->rate_hz);
	scene->camera_count = scene->script.camera_count;
	scene->hd_count = scene->script.hd_camera_count;
	scene->hd_divider = options->hd_divider ? options->hd_divider : DEFAULT_HD_DIVIDER;
	scene->hd_phase = options->hd_phase % scene->hd_divider;
	scene->hd_after_ir_ns = options->hd_after_ir_ns;
	scene->hd_row_ns =
		options->hd_row_ns ? options->hd_row_ns : llround(1e3 * scene->script.hd_row_us);
	face_init(&scene->actors[0].face, options->seed);
	scene->actor_count = 1;
	scene->layout = scene->actors[0].face.layout;
	for (uint32_t m = 0; m < scene->layout.marker_count; m++)
		scene->markers[m].reflectivity = scene->actors[0].face.markers[m].reflectivity;
	sim_cameras_init(scene->cameras, scene->camera_count, &scene->script, options->seed);
	sim_hd_cameras_init(scene->cameras + scene->camera_count, scene->hd_count, &scene->script,
			    options->seed);
	sim_board_init(&scene->board, scene->script.placement, options->seed);
	err = scene_bump_cameras(scene);
	if (err) {
		sim_scene_destroy(scene);
		return err;
	}
	*out = scene;
	return 0;
}

void sim_scene_destroy(struct sim_scene *scene)
{
	if (scene)
		free(scene->bumps);
	free(scene);
}

void scene_pose_markers(const struct sim_scene *scene, double time_s, struct sim_truth *out)
{
	double weights[EXPRESSION_COUNT];

	out->time_s = time_s;
	out->actors[0].rt_stage_head = motion_head(&scene->actors[0].motion, time_s);
	out->actor_count = 1;
	out->ghost_count = 0;
	out->occluder_count = 0;
	out->marker_count = scene->layout.marker_count;
	motion_expressions(&scene->actors[0].motion, time_s, weights);
	for (uint32_t m = 0; m < out->marker_count; m++) {
		struct vec3 normal;
		struct vec3 p = face_marker_place(&scene->actors[0].face, m, weights, &normal);

		out->markers[m].p_stage_m = pose_apply(&out->actors[0].rt_stage_head, p);
		out->markers[m].normal_stage = pose_rotate(&out->actors[0].rt_stage_head, normal);
		out->markers[m].visible_mask = 0;
		out->markers[m].worn = true;
	}
}

static bool inside_image(const struct sim_camera *camera, const double pixel[2])
{
	return pixel[0] >= -0.5 && pixel[1] >= -0.5 && pixel[0] <= camera->width_px - 0.5 &&
	       pixel[1] <= camera->height_px - 0.5;
}

bool scene_camera_sees(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t c,
		       uint32_t m, double pixel[2], double *facing)
{
	const struct sim_camera *camera = scene_camera_at(scene, c, truth->time_s);
	const struct sim_truth_marker *marker = &truth->markers[m];
	struct vec3 to_camera = vec3_unit(vec3_sub(camera->centre_stage_m, marker->p_stage_m));
	double cosine = vec3_dot(to_camera, marker->normal_stage);

	if (cosine < FACING_MIN || scene->script.board)
		return false;
	struct pose rt_head_stage = pose_inverse(&truth->actors[0].rt_stage_head);
	struct vec3 above =
		vec3_add(marker->p_stage_m, vec3_scale(marker->normal_stage, STAND_OFF_M));
	if (face_hides(&scene->actors[0].face, m, pose_apply(&rt_head_stage, above),
		       pose_apply(&rt_head_stage, camera->centre_stage_m)))
		return false;
	*facing = cosine;
	return sim_camera_project(camera, marker->p_stage_m, pixel) && inside_image(camera, pixel);
}

struct exposure scene_exposure(const struct sim_scene *scene, uint32_t camera, uint64_t shot)
{
	if (camera < scene->camera_count)
		return (struct exposure){.mid_s = 1e-9 *
						  (double)sim_scene_mid_exposure_ns(scene, shot),
					 .length_s = 2e-9 * (double)SIM_HALF_EXPOSURE_NS};
	return (struct exposure){.mid_s = 1e-9 * (double)sim_scene_hd_mid_exposure_ns(scene, shot),
				 .row_s = 1e-9 * (double)scene->hd_row_ns,
				 .length_s = 2e-9 * (double)SIM_HD_HALF_EXPOSURE_NS};
}

void sim_scene_truth(const struct sim_scene *scene, double time_s, struct sim_truth *out)
{
	double pixel[2], facing;

	scene_pose_markers(scene, time_s, out);
	for (uint32_t m = 0; m < out->marker_count; m++)
		for (uint32_t c = 0; c < scene->camera_count; c++)
			if (scene_camera_sees(scene, out, c, m, pixel, &facing))
				out->markers[m].visible_mask |= UINT32_C(1) << c;
}

uint32_t sim_scene_camera_count(const struct sim_scene *scene)
{
	return scene->camera_count;
}

uint32_t sim_scene_hd_count(const struct sim_scene *scene)
{
	return scene->hd_count;
}

const char *sim_scene_camera_name(const struct sim_scene *scene, uint32_t camera)
{
	return scene->cameras[camera].name;
}

const struct sim_script *sim_scene_script(const struct sim_scene *scene)
{
	return &scene->script;
}

const struct layout *sim_scene_layout(const struct sim_scene *scene)
{
	return &scene->layout;
}

int64_t sim_scene_mid_exposure_ns(const struct sim_scene *scene, uint64_t shot)
{
	return (int64_t)shot * scene->period_ns + scene->period_ns / 2;
}

int64_t sim_scene_period_ns(const struct sim_scene *scene)
{
	return scene->period_ns;
}

uint64_t sim_scene_hd_shot(const struct sim_scene *scene, uint64_t k)
{
	return k * scene->hd_divider + scene->hd_phase;
}

int64_t sim_scene_hd_mid_exposure_ns(const struct sim_scene *scene, uint64_t shot)
{
	return sim_scene_mid_exposure_ns(scene, shot) + scene->hd_after_ir_ns;
}
