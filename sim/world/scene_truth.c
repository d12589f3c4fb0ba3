/*
 * Where everything is at a scene time.
 */
#include "sim/face/ease.h"
#include "sim/occlude.h"
#include "sim/world/scene_parts.h"

/* What all markers of an actor need to know of the moment. */
struct moment {
	const struct sim_scene *scene;
	const struct scene_actor *actor;
	uint32_t index;
	double time_s;
	double weights[BASIS_COUNT];
	struct pose rt_stage_head;
	struct pose rt_head_band;
};

static void pose_face_marker(const struct moment *now, uint32_t m, struct sim_truth_marker *out)
{
	const struct face *face = &now->actor->face;
	struct vec3 normal, p = face_marker_place(face, m, now->weights, &normal);

	if (face->markers[m].wanted.rigid) {
		p = pose_apply(&now->rt_head_band, p);
		normal = pose_rotate(&now->rt_head_band, normal);
	}
	double moved_m = happenings_micro_m(&now->scene->happenings, now->index, m, now->time_s);

	if (moved_m != 0) { /* up along the skin */
		struct vec3 up = {0, 1, 0};

		up = vec3_unit(vec3_sub(up, vec3_scale(normal, vec3_dot(up, normal))));
		p = vec3_add(p, vec3_scale(up, moved_m));
	}
	out->p_stage_m = pose_apply(&now->rt_stage_head, p);
	out->normal_stage = pose_rotate(&now->rt_stage_head, normal);
	out->tucked = face_marker_tucked(face, m, now->weights);
}

static void pose_body_marker(const struct body_marker *marker, const struct pose *rt_stage_segment,
			     struct sim_truth_marker *out)
{
	const struct pose *rt = &rt_stage_segment[marker->segment];

	out->p_stage_m = pose_apply(rt, marker->neutral_m);
	out->normal_stage = pose_rotate(rt, marker->normal);
	out->tucked = false;
}

static void pose_all_markers(const struct moment *now, const struct pose *rt_stage_segment,
			     struct sim_truth_marker *out)
{
	uint32_t face_count = now->actor->face.marker_count;

	for (uint32_t m = 0; m < now->actor->marker_count; m++) {
		if (m < face_count)
			pose_face_marker(now, m, &out[m]);
		else
			pose_body_marker(&now->actor->body.markers[m - face_count],
					 rt_stage_segment, &out[m]);
		out[m].visible_mask = 0;
		out[m].worn = happenings_worn(&now->scene->happenings, now->index, m, now->time_s);
	}
}

static void add_ghosts(const struct moment *now, struct sim_truth *out)
{
	const struct face *face = &now->actor->face;

	for (uint32_t g = 0; g < face->ghost_count; g++) {
		const struct face_ghost *ghost = &face->ghosts[g];

		out->ghosts[out->ghost_count++] = (struct sim_truth_ghost){
			.actor = now->index,
			.centre_stage_m = pose_apply(&now->rt_stage_head, ghost->centre_m),
			.axis_stage = pose_rotate(&now->rt_stage_head, ghost->axis),
			.radius_m = ghost->radius_m,
			.cos_limit = ghost->cos_limit,
			.brightness = face_ghost_brightness(ghost, now->weights)};
	}
}

static struct sim_truth_occluder of_head(const struct pose *rt_stage_head,
					 const struct ellipsoid *shape)
{
	struct pose middle = *rt_stage_head;

	middle.t = pose_apply(rt_stage_head, shape->centre_m);
	return occluder_make(&middle, shape->axes_m);
}

static void add_occluders(const struct moment *now, const struct pose *rt_stage_segment,
			  struct sim_truth *out)
{
	const struct scene_actor *actor = now->actor;

	out->occluders[out->occluder_count++] = of_head(&now->rt_stage_head, &actor->face.skull);
	out->occluders[out->occluder_count++] = of_head(&now->rt_stage_head, &actor->face.nose);
	for (int s = 0; s < SEGMENT_COUNT && actor->has_body; s++) {
		const struct body_flesh *flesh = &actor->body.flesh[s];
		struct pose rt = pose_compose(&rt_stage_segment[s], &flesh->rt_neutral_flesh);

		out->occluders[out->occluder_count++] = occluder_make(&rt, flesh->axes_m);
	}
}

static void pose_actor(const struct sim_scene *scene, uint32_t a, const struct pose *rt_stage_neck,
		       struct sim_truth *out)
{
	const struct scene_actor *actor = &scene->actors[a];
	struct sim_truth_actor *truth = &out->actors[a];
	struct moment now = {scene, actor, a, .time_s = out->time_s};

	performance_weights(&actor->performance, now.time_s, now.weights);
	happenings_express(&scene->happenings, a, now.time_s, now.weights);
	now.rt_stage_head = motion_head(&actor->motion, now.time_s,
					happenings_turn_rad(&scene->happenings, a, now.time_s));
	now.rt_head_band = happenings_band(&scene->happenings, a, now.time_s);
	truth->rt_stage_head = now.rt_stage_head;
	truth->lips_parted_m = face_lips_parted_m(now.weights);
	truth->lids_closed[0] = face_lid_closed(BASIS_BLINK_L, now.weights);
	truth->lids_closed[1] = face_lid_closed(BASIS_BLINK_R, now.weights);
	body_pose(&actor->body, rt_stage_neck, now.time_s, truth->rt_stage_segment);
	pose_all_markers(&now, truth->rt_stage_segment, &out->markers[actor->first_marker]);
	add_ghosts(&now, out);
	add_occluders(&now, truth->rt_stage_segment, out);
}

void scene_pose_markers(const struct sim_scene *scene, double time_s, struct sim_truth *out)
{
	struct pose rt_stage_neck[SIM_ACTOR_MAX];

	out->time_s = time_s;
	out->actor_count = scene->actor_count;
	out->marker_count = scene->layout.marker_count;
	out->ghost_count = 0;
	out->occluder_count = 0;
	for (uint32_t a = 0; a < scene->actor_count; a++) {
		rt_stage_neck[a] = motion_neck(&scene->actors[a].motion, time_s);
		pose_actor(scene, a, &rt_stage_neck[a], out);
	}
	if (scene->actor_count)
		out->occluder_count +=
			happenings_occluders(&scene->happenings, rt_stage_neck, time_s,
					     &out->occluders[out->occluder_count],
					     SIM_OCCLUDER_MAX - out->occluder_count);
}
