/*
 * Least squares, and again without those that do not fit.
 */
#include "demo/align.h"

#define SETS 120
#define PAIRS_MIN 100

static void add_pairs(struct align *align, const struct referee *referee,
		      const struct stage_marker_set *set, const struct sim_truth *truth)
{
	for (uint32_t i = 0; i < set->marker_count && align->count < ALIGN_PAIRS; i++) {
		const struct stage_marker *marker = &set->markers[i];

		if (marker->status != STAGE_MEASURED || marker->label < 0 ||
		    (uint32_t)marker->label >= referee->label_count)
			continue;
		uint32_t own = referee->truth_of_label[marker->label];
		align->pairs[align->count++] = (struct rigid_pair){
			.from = {marker->p_m[0], marker->p_m[1], marker->p_m[2]},
			.to = truth->markers[own].p_stage_m,
			.weight = 1};
	}
}

static void leave_out(struct align *align, const struct pose *pose)
{
	for (int i = 0; i < align->count; i++)
		align->pairs[i].weight = rigid_error(&align->pairs[i], pose) <= REFEREE_NEAR_M;
}

void align_take(struct align *align, struct referee *referee, const struct stage_marker_set *set)
{
	struct pose pose;

	referee_find_truth(referee, set->mid_exposure_ns);
	add_pairs(align, referee, set, &referee->truth);
	if (++align->sets < SETS || align->count < PAIRS_MIN)
		return;
	if (rigid_fit(align->pairs, align->count, &pose))
		return;
	leave_out(align, &pose);
	if (rigid_fit(align->pairs, align->count, &pose))
		return;
	referee->rt_scene_station = pose;
	align->done = true;
}
