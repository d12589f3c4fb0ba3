/*
 * What the tracker cannot know of an actor unless the layout says it.
 */
#include "ctl/layout_warnings.h"

#include <math.h>

#include "track/predict.h"

#define FACE_MIN 20 /* skin markers: fewer are no face with lips */

static uint32_t count_skin(const struct layout *layout, const struct layout_actor *actor)
{
	uint32_t count = 0;

	for (uint32_t m = actor->first; m < actor->first + actor->count; m++)
		count += !layout->markers[m].rigid && !layout->markers[m].segment[0];
	return count;
}

static bool has_opposed(const struct layout *layout, const struct layout_actor *actor)
{
	uint32_t end = actor->first + actor->count;

	for (uint32_t m = actor->first; m < end; m++)
		for (uint32_t k = m + 1; k < end; k++)
			if (predict_opposes(layout->markers[m].group, layout->markers[k].group))
				return true;
	return false;
}

/* Which marker lies across the mouth or the eye from which, only the groups' names say. */
static bool lacks_groups(const struct stage *stage, uint32_t a)
{
	const struct layout_actor *actor = &stage->layout.actors[a];

	return count_skin(&stage->layout, actor) >= FACE_MIN && !has_opposed(&stage->layout, actor);
}

#define GROUPS_WANTED                                                                        \
	"no two groups differ in 'upper' and 'lower' alone: name those of lips and lids so " \
	"(lip_upper, lip_lower), or their markers are taken to move as one"

#define OFF_LINE_MIN_M 0.01

/* How far the rigid markers reach beside the line through the two that are farthest apart. */
static double rigid_off_line_m(const struct layout *layout, const struct layout_actor *actor)
{
	const struct layout_marker *m = layout->markers + actor->first;
	struct vec3 from = {0}, line = {0};
	double off_m = 0;

	for (uint32_t a = 0; a < actor->count; a++)
		for (uint32_t b = 0; b < a && m[a].rigid; b++) {
			struct vec3 apart = vec3_sub(m[a].neutral_m, m[b].neutral_m);

			if (!m[b].rigid || vec3_norm(apart) <= vec3_norm(line))
				continue;
			from = m[b].neutral_m;
			line = apart;
		}
	for (uint32_t a = 0; a < actor->count && vec3_norm(line) > 0; a++) {
		struct vec3 across = vec3_cross(line, vec3_sub(m[a].neutral_m, from));

		if (m[a].rigid)
			off_m = fmax(off_m, vec3_norm(across) / vec3_norm(line));
	}
	return off_m;
}

/* Of actors with a head: a body's segments are rigid by themselves. */
static bool lacks_rigid(const struct stage *stage, uint32_t a)
{
	const struct layout_actor *actor = &stage->layout.actors[a];

	return count_skin(&stage->layout, actor) &&
	       rigid_off_line_m(&stage->layout, actor) < OFF_LINE_MIN_M;
}

#define RIGID_WANTED                                                                            \
	"its rigid markers lie on one line, or there are fewer than three: how the head turns " \
	"cannot be seen; give it three or more with rigid: true, spread over the head band"

static const struct {
	bool (*applies)(const struct stage *stage, uint32_t actor);
	const char *text;
} warnings[] = {{lacks_groups, GROUPS_WANTED}, {lacks_rigid, RIGID_WANTED}};

json_t *layout_warnings(const struct stage *stage)
{
	json_t *found = json_array();

	for (uint32_t a = 0; a < stage->layout.actor_count; a++)
		for (size_t w = 0; w < sizeof(warnings) / sizeof(*warnings); w++)
			if (warnings[w].applies(stage, a))
				json_array_append_new(
					found, json_sprintf("%s: %s", stage->config.layout_paths[a],
							    warnings[w].text));
	return found;
}
