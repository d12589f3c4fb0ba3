/*
 * Truth lines with 17 digits: what is read back is what was rendered.
 */
#include "sim/truth_json.h"

#include <errno.h>
#include <jansson.h>

#include "sim/scene_parts.h"

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

static json_t *markers_json(const struct sim_scene *scene, const struct sim_truth *truth)
{
	json_t *markers = json_array();

	for (uint32_t m = 0; m < truth->marker_count; m++) {
		const struct sim_truth_marker *marker = &truth->markers[m];

		json_array_append_new(markers,
				      json_pack("{s:s,s:o,s:i,s:o}", "name",
						scene->layout.markers[m].name, "p_m",
						vec3_json(marker->p_stage_m), "cameras",
						__builtin_popcount(marker->visible_mask), "visible",
						visible_json(scene, marker->visible_mask)));
	}
	return markers;
}

int truth_json_write(const struct sim_scene *scene, uint64_t shot, const struct sim_truth *truth,
		     FILE *file)
{
	json_t *line = json_pack("{s:I,s:I,s:o,s:o}", "shot", (json_int_t)shot, "mid_exposure_ns",
				 (json_int_t)sim_scene_mid_exposure_ns(scene, shot), "head",
				 pose_json(&truth->actors[0].rt_stage_head), "markers",
				 markers_json(scene, truth));

	if (!line)
		return -ENOMEM;
	if (scene->script.board) { /* rt_stage_board */
		struct pose rt = sim_board_pose(&scene->board, truth->time_s);

		json_object_set_new(line, "board", pose_json(&rt));
	}
	int bad = json_dumpf(line, file, JSON_COMPACT | JSON_REAL_PRECISION(17)) != 0 ||
		  fputc('\n', file) == EOF;

	json_decref(line);
	return bad ? -EIO : 0;
}
