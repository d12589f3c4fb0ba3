/*
 * The blob finder's memory, and which of its two builds runs.
 */
#include "track/blobs.h"

#include <errno.h>
#include <stdlib.h>

#include "track/blobs_parts.h"

struct blob_settings blob_settings_default(void)
{
	return (struct blob_settings){.threshold_sigma = 6,
				      .threshold_min = 8,
				      .electrons_per_grey = 40,
				      .area_min_px = 3,
				      .area_max_px = 20000};
}

int blob_finder_create(struct blob_finder **out, int width_px, int height_px,
		       const struct blob_settings *settings)
{
	struct blob_finder *finder = calloc(1, sizeof(*finder));
	size_t groups = (size_t)((width_px + GROUP_PX - 1) / GROUP_PX);

	if (!finder)
		return -ENOMEM;
	finder->settings = *settings;
	finder->width_px = width_px;
	finder->height_px = height_px;
	finder->group_count = (int)groups;
	finder->run = blob_run_best();
	finder->coarse = calloc(groups, CELL_PX);
	finder->groups = calloc(groups, sizeof(*finder->groups));
	finder->candidates = calloc(groups * (size_t)height_px + 1, sizeof(*finder->candidates));
	if (!finder->coarse || !finder->groups || !finder->candidates ||
	    level_map_init(&finder->map, width_px, height_px))
		goto fail;
	*out = finder;
	return 0;
fail:
	blob_finder_destroy(finder);
	return -ENOMEM;
}

void blob_finder_destroy(struct blob_finder *finder)
{
	if (!finder)
		return;
	level_map_finish(&finder->map);
	free(finder->candidates);
	free(finder->groups);
	free(finder->coarse);
	free(finder);
}

void blob_finder_use(struct blob_finder *finder, blob_run_fn *run)
{
	finder->run = run;
}

void blob_finder_run(struct blob_finder *finder, const struct grey_image *image,
		     struct blob_set *set)
{
	finder->run(finder, image, set);
}
