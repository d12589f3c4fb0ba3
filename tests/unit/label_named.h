/*
 * The label of a marker in a play, by its name. Failing is cmocka's: include that before.
 */
#pragma once

#include <string.h>

#include "sim/play.h"

static uint32_t label_named(const struct sim_play *play, const char *name)
{
	const struct layout *layout = sim_scene_layout(play->scene);

	for (uint32_t i = 0; i < layout->marker_count; i++)
		if (strcmp(layout->markers[i].name, name) == 0)
			return i;
	fail_msg("no marker %s", name);
	return 0;
}
