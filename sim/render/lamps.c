/*
 * A lamp's brightness does not change with range; only its size does.
 */
#include "sim/render/lamps.h"

#include "sim/occlude.h"
#include "sim/render/marker_spot.h"

#define STROBE_RADIUS_M 0.035
#define STROBE_GREY 2500.0
#define STROBE_COSINE 0.77 /* it shines 40 degrees to each side */
#define LED_RADIUS_M 2.5e-3
#define LED_GREY 160.0
#define LED_COSINE 0.5
#define RING_RADIUS_M 0.045

/* In the way of its middle: somebody in the room. */
static bool is_hidden(const struct sim_truth *truth, const struct sim_camera *lamp,
		      const struct sim_camera *camera)
{
	for (uint32_t i = 0; i < truth->occluder_count; i++)
		if (occluder_hides(&truth->occluders[i], lamp->centre_stage_m,
				   camera->centre_stage_m))
			return true;
	return false;
}

static bool shines_at(const struct sim_truth *truth, const struct sim_camera *lamp,
		      const struct sim_camera *camera, double cosine_min)
{
	struct vec3 to_camera = vec3_unit(vec3_sub(camera->centre_stage_m, lamp->centre_stage_m));
	struct vec3 forward = {lamp->rt_cam_stage.r[2][0], lamp->rt_cam_stage.r[2][1],
			       lamp->rt_cam_stage.r[2][2]};

	return vec3_dot(forward, to_camera) > cosine_min && !is_hidden(truth, lamp, camera);
}

/* Adds the disc when it is at least in part in the image. */
static uint32_t add_lamp(const struct sim_camera *camera, struct vec3 p_stage_m, double radius_m,
			 double grey, struct spot *out)
{
	struct vec3 to_camera = vec3_unit(vec3_sub(camera->centre_stage_m, p_stage_m));

	if (!disc_spot(camera, p_stage_m, to_camera, radius_m, grey, out))
		return 0;
	struct pixel_window window = pixel_window_around(out->centre_px, spot_radius_px(out),
							 camera->width_px, camera->height_px);

	return pixel_window_count(&window) > 0;
}

static uint32_t add_ring(const struct sim_camera *camera, const struct sim_camera *lamp,
			 struct spot *out)
{
	struct pose rt_stage_cam = pose_inverse(&lamp->rt_cam_stage);
	uint32_t count = 0;

	for (int led = 0; led < LAMP_RING_LEDS; led++) {
		double angle = 2 * M_PI * led / LAMP_RING_LEDS;
		struct vec3 place = {RING_RADIUS_M * cos(angle), RING_RADIUS_M * sin(angle), 0};

		count += add_lamp(camera, pose_apply(&rt_stage_cam, place), LED_RADIUS_M, LED_GREY,
				  &out[count]);
	}
	return count;
}

uint32_t lamps_find(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t c,
		    bool strobes_lit, struct spot out[LAMP_MAX])
{
	const struct sim_camera *camera = scene_camera_at(scene, c, truth->time_s);
	uint32_t count = 0;

	for (uint32_t i = 0; strobes_lit && scene->script.cross_strobes && i < scene->camera_count;
	     i++)
		if (i != c && shines_at(truth, &scene->cameras[i], camera, STROBE_COSINE))
			count += add_lamp(camera, scene->cameras[i].centre_stage_m, STROBE_RADIUS_M,
					  STROBE_GREY, &out[count]);
	for (uint32_t i = 0; scene->script.ring_lights && i < scene->hd_count; i++)
		if (shines_at(truth, &scene->cameras[scene->camera_count + i], camera, LED_COSINE))
			count += add_ring(camera, &scene->cameras[scene->camera_count + i],
					  &out[count]);
	return count;
}
