/*
 * A scene for one test, written as its file.
 */
#pragma once

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "sim/world/scene_parts.h"

/* Fails the test when it cannot be made. `actors` and `events`: YAML lists, one line each. */
static inline struct sim_scene *scene_written(uint32_t cameras, uint64_t seed, const char *actors,
					      const char *events)
{
	char path[] = "/tmp/sim-written-XXXXXX";
	struct sim_options options = {.scene = path, .seed = seed};
	struct sim_scene *scene = NULL;
	struct diag diag = {0};
	FILE *file = fdopen(mkstemp(path), "w");

	assert_non_null(file);
	fprintf(file, "title: a test\nseconds: 60\ncameras: %u\n%sactors:\n%s\n%s%s\n", cameras,
		cameras > 8 ? "placement: room\n" : "", actors, *events ? "events:\n" : "", events);
	fclose(file);
	int err = sim_scene_create(&scene, &options, &diag);

	unlink(path);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	assert_int_equal(err, 0);
	return scene;
}

static inline uint32_t label_named(const struct sim_scene *scene, const char *name)
{
	for (uint32_t m = 0; m < scene->layout.marker_count; m++)
		if (strcmp(scene->layout.markers[m].name, name) == 0)
			return m;
	fail_msg("no marker %s", name);
	return 0;
}

/* In the coordinates of its actor's head. */
static inline struct vec3 on_head(const struct sim_scene *scene, const struct sim_truth *truth,
				  uint32_t label)
{
	uint32_t actor = scene->markers[label].actor;
	struct pose back = pose_inverse(&truth->actors[actor].rt_stage_head);

	return pose_apply(&back, truth->markers[label].p_stage_m);
}
