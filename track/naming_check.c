/*
 * A stage that is empty, or where few markers are in view, tells nothing: the middle camera must
 * see a good part of the layout.
 */
#include "track/naming_check.h"

#define SPOTS_MIN 10.0
#define SPOTS_SHARE 0.25 /* of the layout's markers */
#define NAMED_SHARE 0.1  /* of the spots: fewer names are none */
#define POINTS_SHARE 0.4 /* of the spots: fewer points are chance */

const char *naming_remedy(enum naming naming)
{
	static const char *const remedies[] = {
		[NAMING_NO_POINTS] =
			"what the cameras see does not meet: their addresses are swapped (stagectl "
			"camera preview shows who sees what), or the rig is another stage's or "
			"another day's (stagectl calibrate cameras)",
		[NAMING_NO_NAMES] =
			"the points are no markers of the layout: it is another actor's or another "
			"day's (layout in the config; stagectl calibrate actor), or the cameras' "
			"addresses are swapped or the rig is another stage's",
	};

	return remedies[naming];
}

/* The lower middle one of those that were there. */
static uint32_t middle_spots(const struct tracker_rig *rig, const struct shot *shot)
{
	uint32_t sorted[CAMERA_MAX], count = 0;

	for (uint32_t c = 0; c < shot->camera_count; c++) {
		uint32_t at = count;

		if (!rig->views[c] || !shot->sets[c])
			continue;
		for (; at > 0 && sorted[at - 1] > shot->sets[c]->blob_count; at--)
			sorted[at] = sorted[at - 1];
		sorted[at] = shot->sets[c]->blob_count;
		count++;
	}
	return count ? sorted[(count - 1) / 2] : 0;
}

static uint32_t count_named(const struct marker_set *set)
{
	uint32_t named = 0;

	for (uint32_t i = 0; i < set->label_count; i++)
		named += set->markers[i].status >= MARKER_TWO_CAMERA;
	return named;
}

static enum naming judge(const struct naming_means *means, uint32_t marker_count)
{
	double spots_min = SPOTS_SHARE * marker_count;

	if (means->spots < SPOTS_MIN || means->spots < spots_min ||
	    means->named >= NAMED_SHARE * means->spots)
		return NAMING_FINE;
	return means->points < POINTS_SHARE * means->spots ? NAMING_NO_POINTS : NAMING_NO_NAMES;
}

bool naming_check_run(struct naming_check *check, const struct tracker_rig *rig,
		      const struct shot *shot, const struct marker_set *set)
{
	struct naming_means *sums = &check->sums;
	uint32_t named = count_named(set);

	if (!check->shots++)
		check->block_began_ns = shot->mid_exposure_ns;
	sums->spots += middle_spots(rig, shot);
	sums->points += named + set->marker_count - set->label_count;
	sums->named += named;
	if (shot->mid_exposure_ns - check->block_began_ns < NAMING_BLOCK_NS)
		return false;
	check->means =
		(struct naming_means){sums->spots / check->shots, sums->points / check->shots,
				      sums->named / check->shots};
	check->naming = judge(&check->means, rig->layout->marker_count);
	check->blocks_in_a_row = check->naming ? check->blocks_in_a_row + 1 : 0;
	check->shots = 0;
	*sums = (struct naming_means){0};
	return true;
}
