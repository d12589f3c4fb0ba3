/*
 * Who sees what: facing, within the image, and with nothing in between. The cheap questions come
 * first; an ellipsoid is asked only when it can stand between a camera and a whole face or body.
 */
#include "sim/occlude.h"
#include "sim/world/scene_parts.h"

#define STAND_OFF_M 0.5e-3 /* a disc lies on the skin, not in it */
#define LAMP_OFF_M 0.03    /* a strobe's middle above its lens */
#define BORDER_STEPS 128

static bool inside_image(const struct sim_camera *camera, const double pixel[2])
{
	return pixel[0] >= -0.5 && pixel[1] >= -0.5 && pixel[0] <= camera->width_px - 0.5 &&
	       pixel[1] <= camera->height_px - 0.5;
}

static bool ray_in_image(const struct sim_camera *camera, const double ray[2])
{
	struct pose rt_stage_cam = pose_inverse(&camera->rt_cam_stage);
	double pixel[2];

	return sim_camera_project(camera,
				  pose_apply(&rt_stage_cam, (struct vec3){ray[0], ray[1], 1}),
				  pixel) &&
	       inside_image(camera, pixel);
}

/* How far the image goes from its middle in a direction. */
static double border(const struct sim_camera *camera, double angle_rad)
{
	double in = 0, out = 1.5;

	for (int i = 0; i < 20; i++) {
		double middle = 0.5 * (in + out);
		double ray[2] = {middle * cos(angle_rad), middle * sin(angle_rad)};

		if (ray_in_image(camera, ray))
			in = middle;
		else
			out = middle;
	}
	return in;
}

/* A side's inner bound is its nearest border among rays well within that side's quarter; what the
 * steps in between may miss is taken off. */
static void set_window(struct scene_window *window, const struct sim_camera *camera)
{
	const double slack = 0.004;
	double corner = atan2(camera->height_px, camera->width_px);

	*window = (struct scene_window){.inner = {-9, 9, -9, 9}};
	for (int i = 0; i < BORDER_STEPS; i++) {
		double angle = 2 * M_PI * i / BORDER_STEPS, reach = border(camera, angle);
		double x = reach * cos(angle), y = reach * sin(angle);
		bool side = fabs(sin(angle)) < sin(corner);

		window->outer[0] = fmin(window->outer[0], x - slack);
		window->outer[1] = fmax(window->outer[1], x + slack);
		window->outer[2] = fmin(window->outer[2], y - slack);
		window->outer[3] = fmax(window->outer[3], y + slack);
		if (side && x < 0)
			window->inner[0] = fmax(window->inner[0], x + slack);
		else if (side)
			window->inner[1] = fmin(window->inner[1], x - slack);
		else if (y < 0)
			window->inner[2] = fmax(window->inner[2], y + slack);
		else
			window->inner[3] = fmin(window->inner[3], y - slack);
	}
}

void scene_set_windows(struct sim_scene *scene)
{
	for (uint32_t c = 0; c < scene->camera_count + scene->hd_count; c++)
		set_window(&scene->windows[c], &scene->cameras[c]);
}

static bool within(const double bounds[4], struct vec3 p_cam)
{
	return p_cam.x > bounds[0] * p_cam.z && p_cam.x < bounds[1] * p_cam.z &&
	       p_cam.y > bounds[2] * p_cam.z && p_cam.y < bounds[3] * p_cam.z;
}

/* Mostly without asking the lens. */
static bool in_picture(const struct sim_camera *camera, const struct scene_window *window,
		       struct vec3 p_stage_m)
{
	struct vec3 p_cam = pose_apply(&camera->rt_cam_stage, p_stage_m);
	double pixel[2];

	if (p_cam.z <= 0 || !within(window->outer, p_cam))
		return false;
	if (within(window->inner, p_cam))
		return true;
	return sim_camera_project(camera, p_stage_m, pixel) && inside_image(camera, pixel);
}

static bool faces(const struct scene_marker *picture, const struct sim_truth_marker *marker,
		  struct vec3 eye)
{
	struct vec3 to_eye = vec3_sub(eye, marker->p_stage_m);
	double along = vec3_dot(to_eye, marker->normal_stage);

	return along > 0 && along * along >= picture->facing_min * picture->facing_min *
						     vec3_dot(to_eye, to_eye);
}

static struct vec3 above(const struct sim_truth_marker *marker)
{
	return vec3_add(marker->p_stage_m, vec3_scale(marker->normal_stage, STAND_OFF_M));
}

bool scene_camera_sees(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t c,
		       uint32_t m, double pixel[2], double *facing)
{
	const struct sim_camera *camera = scene_camera_at(scene, c, truth->time_s);
	const struct sim_truth_marker *marker = &truth->markers[m];
	struct vec3 eye = camera->centre_stage_m, from = above(marker);

	if (!marker->worn || marker->tucked || !faces(&scene->markers[m], marker, eye) ||
	    !in_picture(camera, &scene->windows[c], marker->p_stage_m))
		return false;
	for (int o = 0; o < (int)truth->occluder_count; o++)
		if (o != scene->markers[m].exempt &&
		    occluder_hides(&truth->occluders[o], from, eye))
			return false;
	*facing = vec3_dot(vec3_unit(vec3_sub(eye, marker->p_stage_m)), marker->normal_stage);
	return sim_camera_project(camera, marker->p_stage_m, pixel) && inside_image(camera, pixel);
}

bool scene_camera_sees_ghost(const struct sim_scene *scene, const struct sim_truth *truth,
			     uint32_t c, uint32_t g, struct vec3 *p_stage_m, double pixel[2],
			     double *brightness)
{
	const struct sim_camera *camera = scene_camera_at(scene, c, truth->time_s);
	const struct sim_truth_ghost *ghost = &truth->ghosts[g];
	const double *down = camera->rt_cam_stage.r[1];
	struct vec3 eye = camera->centre_stage_m;
	struct vec3 lamp =
		vec3_sub(eye, vec3_scale((struct vec3){down[0], down[1], down[2]}, LAMP_OFF_M));
	struct vec3 mirror = vec3_unit(vec3_add(vec3_unit(vec3_sub(eye, ghost->centre_stage_m)),
						vec3_unit(vec3_sub(lamp, ghost->centre_stage_m))));
	double inside = vec3_dot(mirror, ghost->axis_stage) - ghost->cos_limit;
	struct vec3 p = vec3_add(ghost->centre_stage_m, vec3_scale(mirror, ghost->radius_m));

	if (ghost->brightness <= 0 || inside <= 0)
		return false;
	for (uint32_t o = 0; o < truth->occluder_count; o++)
		if (o != scene->actors[ghost->actor].first_occluder &&
		    occluder_hides(&truth->occluders[o], p, eye))
			return false;
	if (!sim_camera_project(camera, p, pixel) || !inside_image(camera, pixel))
		return false;
	*p_stage_m = p;
	*brightness = ghost->brightness * fmin(1, inside / 0.05);
	return true;
}

#define GROUP_MAX (2 * SIM_ACTOR_MAX)

/* The markers of a face or a body, and a sphere around them. */
struct group {
	uint32_t first, count;
	struct vec3 middle;
	double radius_m;
};

/* One camera before one truth. */
struct look {
	const struct sim_scene *scene;
	const struct sim_truth *truth;
	uint32_t group_count;
	struct group groups[GROUP_MAX];
	uint32_t index;
	const struct sim_camera *camera;
	struct vec3 eye;
	struct vec3 eye_unit[SIM_OCCLUDER_MAX];
};

static uint64_t mattering(const struct look *look, const struct group *group)
{
	uint64_t mask = 0;

	for (uint32_t o = 0; o < look->truth->occluder_count; o++)
		if (occluder_matters(&look->truth->occluders[o], group->middle, group->radius_m,
				     look->eye))
			mask |= UINT64_C(1) << o;
	return mask;
}

static bool sees(const struct look *look, uint32_t m, uint64_t mask)
{
	const struct sim_truth_marker *marker = &look->truth->markers[m];
	const struct scene_marker *picture = &look->scene->markers[m];
	struct vec3 from = above(marker);

	if (!marker->worn || marker->tucked || !faces(picture, marker, look->eye) ||
	    !in_picture(look->camera, &look->scene->windows[look->index], marker->p_stage_m))
		return false;
	if (picture->exempt >= 0)
		mask &= ~(UINT64_C(1) << picture->exempt);
	for (; mask; mask &= mask - 1) {
		int o = __builtin_ctzll(mask);

		if (occluder_hides_from(&look->truth->occluders[o], from, look->eye_unit[o]))
			return false;
	}
	return true;
}

static void look_at(const struct look *look, const struct group *group, struct sim_truth *out)
{
	uint64_t mask = mattering(look, group);

	for (uint32_t m = group->first; m < group->first + group->count; m++)
		if (sees(look, m, mask))
			out->markers[m].visible_mask |= UINT32_C(1) << look->index;
}

static void add_group(struct look *look, uint32_t first, uint32_t count)
{
	struct group *group = &look->groups[look->group_count];
	struct vec3 sum = {0, 0, 0};
	double most2 = 0;

	if (count == 0)
		return;
	for (uint32_t m = first; m < first + count; m++)
		sum = vec3_add(sum, look->truth->markers[m].p_stage_m);
	*group = (struct group){.first = first, .count = count};
	group->middle = vec3_scale(sum, 1.0 / count);
	for (uint32_t m = first; m < first + count; m++) {
		struct vec3 d = vec3_sub(look->truth->markers[m].p_stage_m, group->middle);

		most2 = fmax(most2, vec3_dot(d, d));
	}
	group->radius_m = sqrt(most2);
	look->group_count++;
}

static void look_around(struct look *look, struct sim_truth *out)
{
	struct vec3 p;
	double pixel[2], brightness;

	look->camera = scene_camera_at(look->scene, look->index, out->time_s);
	look->eye = look->camera->centre_stage_m;
	for (uint32_t o = 0; o < out->occluder_count; o++)
		look->eye_unit[o] = occluder_to_unit(&out->occluders[o], look->eye);
	for (uint32_t g = 0; g < look->group_count; g++)
		look_at(look, &look->groups[g], out);
	for (uint32_t g = 0; g < out->ghost_count; g++)
		if (scene_camera_sees_ghost(look->scene, out, look->index, g, &p, pixel,
					    &brightness))
			out->ghosts[g].visible_mask |= UINT32_C(1) << look->index;
}

void sim_scene_truth(const struct sim_scene *scene, double time_s, struct sim_truth *out)
{
	struct look look = {.scene = scene, .truth = out};

	scene_pose_markers(scene, time_s, out);
	for (uint32_t a = 0; a < scene->actor_count; a++) {
		const struct scene_actor *actor = &scene->actors[a];
		uint32_t face_count = actor->face.marker_count;

		add_group(&look, actor->first_marker, face_count);
		add_group(&look, actor->first_marker + face_count,
			  actor->marker_count - face_count);
	}
	for (look.index = 0; look.index < scene->camera_count; look.index++)
		look_around(&look, out);
}
