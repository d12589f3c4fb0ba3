/*
 * What was captured, kept in memory.
 */
#include "calib/actor/actor.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

#define GROW_SHOTS 64
/* a little less than the gap, as exposures wander */
#define GAP_MIN_NS ((int64_t)(0.97 * (double)NS_PER_S / ACTOR_RATE_HZ))

void actor_part_finish(struct actor_part *part)
{
	free(part->time_ns);
	free(part->p_m);
	*part = (struct actor_part){0};
}

void actor_part_clear(struct actor_part *part)
{
	part->shot_count = 0;
}

static int grow(struct actor_part *part)
{
	uint32_t max = part->shot_max + GROW_SHOTS;
	int64_t *time_ns = realloc(part->time_ns, max * sizeof(*time_ns));

	if (!time_ns)
		return -ENOMEM;
	part->time_ns = time_ns;
	struct vec3 *p_m =
		realloc(part->p_m, (size_t)max * part->marker_count * sizeof(*part->p_m));
	if (!p_m)
		return -ENOMEM;
	part->p_m = p_m;
	part->shot_max = max;
	return 0;
}

int actor_part_add(struct actor_part *part, const struct actor_shot *shot)
{
	uint32_t n = part->shot_count;

	if (n > 0 && shot->mid_exposure_ns - part->time_ns[n - 1] < GAP_MIN_NS)
		return 0;
	part->marker_count = shot->count;
	if (n == part->shot_max && grow(part) < 0)
		return -ENOMEM;
	part->time_ns[n] = shot->mid_exposure_ns;
	for (uint32_t i = 0; i < shot->count; i++)
		part->p_m[(size_t)n * shot->count + i] =
			shot->seen[i] ? shot->p_m[i] : (struct vec3){NAN, 0, 0};
	part->shot_count++;
	return 0;
}

void actor_layout(const struct layout *all, uint32_t actor, struct layout *out)
{
	const struct layout_actor *from = &all->actors[actor];

	memset(out, 0, sizeof(*out));
	out->actor_count = 1;
	out->actors[0] = *from;
	out->actors[0].first = 0;
	out->marker_count = from->count;
	memcpy(out->markers, all->markers + from->first, from->count * sizeof(out->markers[0]));
}
