/*
 * Truth lines with 17 digits: what is read back is what was rendered.
 */
#include "sim/truth_json.h"

#include <errno.h>
#include <jansson.h>

#include "sim/world/scene_parts.h"

static json_t *vec3_json(struct vec3 v)
{
	return json_pack("[f,f,f]", v.x, v.y, v.z);
}

static json_t *pose_json(const struct pose *pose)
{
	double q[4];

	pose_to_quaternion(pose, q);
	return json_pack("{s:[f,f,f,f],s:o}", "q", q[0], q[1], q[2], q[3], "t_m",
			 vec3_json(pose->t));
}

static json_t *visible_json(const struct sim_scene *scene, uint32_t mask)
{
	json_t *names = json_array();

	for (uint32_t c = 0; c < scene->camera_count; c++)
		if (mask >> c & 1)
			json_array_append_new(names, json_string(scene->cameras[c].name));
	return names;
}

static json_t *marker_json(const struct sim_scene *scene, const struct sim_truth *truth, uint32_t m)
{
	const struct sim_truth_marker *marker = &truth->markers[m];
	const struct layout_actor *actor = &scene->layout.actors[scene->markers[m].actor];

	return json_pack("{s:s,s:s,s:o,s:b,s:i,s:o}", "name", scene->layout.markers[m].name,
			 "actor", actor->name, "p_m", vec3_json(marker->p_stage_m), "worn",
			 marker->worn, "cameras", __builtin_popcount(marker->visible_mask),
			 "visible", visible_json(scene, marker->visible_mask));
}

static json_t *markers_json(const struct sim_scene *scene, const struct sim_truth *truth)
{
	json_t *markers = json_array();

	for (uint32_t m = 0; m < truth->marker_count; m++)
		json_array_append_new(markers, marker_json(scene, truth, m));
	return markers;
}

static json_t *heads_json(const struct sim_scene *scene, const struct sim_truth *truth)
{
	json_t *heads = json_array();

	for (uint32_t a = 0; a < truth->actor_count; a++) {
		json_t *head = pose_json(&truth->actors[a].rt_stage_head);

		json_object_set_new(head, "actor", json_string(scene->layout.actors[a].name));
		json_array_append_new(heads, head);
	}
	return heads;
}

static json_t *ghosts_json(const struct sim_scene *scene, const struct sim_truth *truth)
{
	json_t *ghosts = json_array();

	for (uint32_t g = 0; g < truth->ghost_count; g++)
		json_array_append_new(
			ghosts,
			json_pack("{s:o,s:o}", "p_m", vec3_json(truth->ghosts[g].centre_stage_m),
				  "visible", visible_json(scene, truth->ghosts[g].visible_mask)));
	return ghosts;
}

int truth_json_write(const struct sim_scene *scene, uint64_t shot, const struct sim_truth *truth,
		     FILE *file)
{
	json_t *line =
		json_pack("{s:I,s:I,s:o,s:o,s:o}", "shot", (json_int_t)shot, "mid_exposure_ns",
			  (json_int_t)sim_scene_mid_exposure_ns(scene, shot), "heads",
			  heads_json(scene, truth), "markers", markers_json(scene, truth), "ghosts",
			  ghosts_json(scene, truth));

	if (!line)
		return -ENOMEM;
	if (truth->actor_count) /* of the first actor, by itself */
		json_object_set_new(line, "head", pose_json(&truth->actors[0].rt_stage_head));
	if (scene->script.board) { /* rt_stage_board */
		struct pose rt = sim_board_pose(&scene->board, truth->time_s);

		json_object_set_new(line, "board", pose_json(&rt));
	}
	int bad = json_dumpf(line, file, JSON_COMPACT | JSON_REAL_PRECISION(17)) != 0 ||
		  fputc('\n', file) == EOF;

	json_decref(line);
	return bad ? -EIO : 0;
}
