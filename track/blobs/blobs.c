/*
 * The blob finder's memory, and which of its builds runs.
 */
#include "track/blobs/blobs.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "track/blobs/blobs_parts.h"

struct blob_settings blob_settings_default(void)
{
	return (struct blob_settings){.threshold_sigma = 6,
				      .threshold_min = 8,
				      .electrons_per_grey = 40,
				      .area_min_px = 3,
				      .area_max_px = 20000};
}

static void level_map_finish(struct level_map *map)
{
	free(map->nodes);
	free(map->survey);
	memset(map, 0, sizeof(*map));
}

static int level_map_init(struct level_map *map, int width_px, int height_px)
{
	size_t count;

	memset(map, 0, sizeof(*map));
	map->x_count = (width_px + GROUP_PX - 1) / GROUP_PX + 1;
	map->y_count = (height_px + CELL_PX - 1) / CELL_PX;
	for (int r = 0; r < SURVEY_ROWS; r++)
		map->survey_y[r] = (2 * r + 1) * map->y_count / (2 * SURVEY_ROWS) * CELL_PX;
	count = (size_t)map->x_count * (size_t)map->y_count;
	map->nodes = calloc(count, sizeof(*map->nodes));
	map->survey = calloc((size_t)map->x_count, SURVEY_ROWS * sizeof(*map->survey));
	if (map->nodes && map->survey)
		return 0;
	level_map_finish(map);
	return -ENOMEM;
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
	finder->builds = blob_builds_best();
	finder->coarse = calloc(groups, CELL_PX * sizeof(uint16_t));
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

void blob_finder_use(struct blob_finder *finder, struct blob_builds builds)
{
	finder->builds = builds;
}

void blob_finder_run(struct blob_finder *finder, const struct grey_image *image,
		     struct blob_set *set)
{
	if (image->bits > 8)
		finder->builds.grey16(finder, image, set);
	else
		finder->builds.grey8(finder, image, set);
}
