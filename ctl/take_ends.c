/*
 * What `stagectl process` says of the take's neutrals.
 */
#include "ctl/take_ends.h"

#include <stdlib.h>

#include "base/clock.h"
#include "calib/actor/actor_take.h"

#define SURE 0.9f /* confidence of a name that is worth learning from */

struct take_ends {
	struct layout layouts[ACTOR_MAX]; /* one actor each */
	struct layout_actor actors[ACTOR_MAX];
	struct actor_take takes[ACTOR_MAX];
	struct actor_shot shot;
	uint32_t actor_count;
};

void actor_shot_of_set(const struct marker_set *set, uint32_t actor, uint32_t first, uint32_t count,
		       struct actor_shot *out)
{
	out->mid_exposure_ns = set->mid_exposure_ns;
	out->head_found = actor < set->head_count && set->heads[actor].valid;
	out->count = count;
	for (uint32_t i = 0; i < count; i++) {
		const struct marker *m = &set->markers[first + i];

		out->seen[i] = m->status == MARKER_MEASURED && m->flags & MARKER_STABILISED &&
			       m->confidence >= SURE;
		out->p_m[i] =
			(struct vec3){m->stabilised_m[0], m->stabilised_m[1], m->stabilised_m[2]};
	}
}

struct take_ends *take_ends_create(const struct layout *layout)
{
	struct take_ends *ends = calloc(1, sizeof(*ends));

	if (!ends)
		return NULL;
	ends->actor_count = layout->actor_count;
	for (uint32_t a = 0; a < layout->actor_count; a++) {
		ends->actors[a] = layout->actors[a];
		actor_layout(layout, a, &ends->layouts[a]);
		actor_take_begin(&ends->takes[a], &ends->layouts[a]);
	}
	return ends;
}

void take_ends_destroy(struct take_ends *ends)
{
	free(ends);
}

void take_ends_step(struct take_ends *ends, const struct marker_set *set)
{
	for (uint32_t a = 0; a < ends->actor_count; a++) {
		actor_shot_of_set(set, a, ends->actors[a].first, ends->actors[a].count,
				  &ends->shot);
		actor_take_step(&ends->takes[a], &ends->shot);
	}
}

static void print_end(FILE *out, const char *which, const struct actor_take *take,
		      const struct take_neutral *neutral)
{
	if (!neutral->found) {
		fprintf(out, " none at the %s", which);
		return;
	}
	fprintf(out, " at the %s %.2f to %.2f s, %.2f mm rms from the layout", which,
		(double)(neutral->begin_ns - take->first_ns) / NS_PER_S,
		(double)(neutral->end_ns - take->first_ns) / NS_PER_S,
		1e3 * neutral->fit.residual_m);
}

void take_ends_print(struct take_ends *ends, FILE *out)
{
	for (uint32_t a = 0; a < ends->actor_count; a++) {
		struct actor_take *take = &ends->takes[a];

		actor_take_end(take);
		fprintf(out, "clean neutral of %s:",
			ends->actors[a].name[0] ? ends->actors[a].name : "the actor");
		print_end(out, "start", take, &take->start);
		fputc(';', out);
		print_end(out, "end", take, &take->end);
		fputc('\n', out);
	}
}
