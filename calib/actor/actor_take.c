/*
 * Every neutral rest is noted as it ends; which of them are at the take's ends, its length decides.
 */
#include "calib/actor/actor_take.h"

#include <string.h>

#include "base/clock.h"

void actor_take_begin(struct actor_take *take, const struct layout *layout)
{
	memset(take, 0, sizeof(*take));
	take->layout = layout;
	actor_rest_begin(&take->finder);
}

static void note_rest(struct actor_take *take, const struct actor_rest *rest)
{
	struct take_neutral neutral = {true, rest->begin_ns, rest->end_ns, {0}};

	if (actor_rest_s(rest) < TAKE_NEUTRAL_S)
		return;
	neutral.fit = actor_rest_fit(rest, take->layout);
	if (!neutral.fit.is_neutral)
		return;
	if (!take->start.found)
		take->start = neutral;
	take->end = neutral;
}

void actor_take_step(struct actor_take *take, const struct actor_shot *shot)
{
	if (take->shots++ == 0)
		take->first_ns = shot->mid_exposure_ns;
	take->last_ns = shot->mid_exposure_ns;
	take->shots_with_head += shot->head_found;
	if (actor_rest_step(&take->finder, shot, &take->ended))
		note_rest(take, &take->ended);
}

void actor_take_end(struct actor_take *take)
{
	int64_t near_ns = (int64_t)(TAKE_END_S * NS_PER_S), half_ns;

	note_rest(take, &take->finder.run);
	half_ns = (take->last_ns - take->first_ns) / 2;
	if (near_ns > half_ns)
		near_ns = half_ns;
	take->start.found &= take->start.begin_ns - take->first_ns <= near_ns;
	take->end.found &= take->last_ns - take->end.end_ns <= near_ns;
}
