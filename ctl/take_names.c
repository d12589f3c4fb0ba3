/*
 * Told when it lasted for a second, or for half of the take.
 */
#include "ctl/take_names.h"

#include "base/clock.h"

#define BLOCKS_MIN (NS_PER_S / NAMING_BLOCK_NS)

void take_names_step(struct take_names *names, const struct shot *shot,
		     const struct marker_set *set)
{
	struct naming_check *check = &names->check;

	if (!naming_check_run(check, &names->stage->tracking, shot, set))
		return;
	names->blocks++;
	if (check->naming == NAMING_FINE)
		return;
	names->unnamed++;
	names->naming = check->naming;
	names->means = check->means;
	if (check->blocks_in_a_row > names->most_in_a_row)
		names->most_in_a_row = check->blocks_in_a_row;
}

static bool is_bad(const struct take_names *names)
{
	return names->unnamed &&
	       (names->most_in_a_row >= BLOCKS_MIN || 2 * names->unnamed >= names->blocks);
}

static double seconds(const struct take_names *names)
{
	return names->unnamed * (double)NAMING_BLOCK_NS / NS_PER_S;
}

void take_names_print(const struct take_names *names, FILE *out)
{
	const struct naming_means *means = &names->means;

	if (!is_bad(names))
		return;
	fprintf(out,
		"no names for %.1f s: cameras see %.0f spots a picture, of which %.1f points and "
		"%.1f of %u markers a shot are made: %s\n",
		seconds(names), means->spots, means->points, means->named,
		names->stage->layout.marker_count, naming_remedy(names->naming));
}

json_t *take_names_json(const struct take_names *names)
{
	const struct naming_means *means = &names->means;

	if (!is_bad(names))
		return json_null();
	return json_pack("{s:f, s:f, s:f, s:f, s:s}", "seconds", seconds(names), "spots",
			 means->spots, "points", means->points, "named", means->named, "remedy",
			 naming_remedy(names->naming));
}
