/*
 * From fronts to a shot.
 */
#include "track/shot.h"

#include <string.h>

struct front front_of_queue(const struct blob_set *set, bool ended)
{
	if (!set)
		return (struct front){.state = ended ? FRONT_ENDED : FRONT_WAITING};
	return (struct front){FRONT_READY, set->shot, set->mid_exposure_ns};
}

void shot_gather(struct shot *shot, const struct sync_decision *decision,
		 const struct blob_set *const sets[CAMERA_MAX], uint32_t camera_count,
		 uint32_t tracked_mask)
{
	memset(shot, 0, sizeof(*shot));
	shot->number = decision->shot;
	shot->mid_exposure_ns = decision->mid_exposure_ns;
	shot->camera_count = camera_count;
	shot->missing_mask = decision->missing_mask & tracked_mask;
	for (uint32_t c = 0; c < camera_count; c++) {
		if (!(decision->member_mask >> c & 1))
			continue;
		shot->sets[c] = sets[c];
		if (sets[c]->uncertainty_ns > shot->uncertainty_ns)
			shot->uncertainty_ns = sets[c]->uncertainty_ns;
	}
}
