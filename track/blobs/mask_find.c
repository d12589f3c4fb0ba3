/*
 * Steady is what is there in nearly every image; joining areas costs the stage the fewest pixels.
 */
#include "track/blobs/mask_find.h"

#include <math.h>
#include <string.h>

#define STEADY_SHARE 0.8f
#define SAME_PLACE_PX 3
#define HALVES_PER_SIGMA 3 /* half the width of an area, in standard deviations of the light */
#define MARGIN_PX 3

void mask_finder_reset(struct mask_finder *finder)
{
	memset(finder, 0, sizeof(*finder));
}

static struct mask_place *place_of(struct mask_finder *finder, const struct blob *blob)
{
	for (uint32_t p = 0; p < finder->place_count; p++) {
		struct mask_place *place = &finder->places[p];
		float reach = 0.25f * (place->right_px - place->left_px);

		reach = reach > SAME_PLACE_PX ? reach : SAME_PLACE_PX;
		if (fabsf(blob->x_px - place->x_px) < reach &&
		    fabsf(blob->y_px - place->y_px) < reach)
			return place;
	}
	if (finder->place_count == MASK_PLACE_MAX)
		return NULL;
	finder->places[finder->place_count] = (struct mask_place){
		blob->x_px, blob->y_px, blob->x_px, blob->x_px, blob->y_px, blob->y_px, 0, 0};
	return &finder->places[finder->place_count++];
}

static void see(struct mask_place *place, const struct blob *blob, uint32_t set)
{
	float half_x = HALVES_PER_SIGMA * sqrtf(fmaxf(blob->shape_px2[0], 0)) + MARGIN_PX;
	float half_y = HALVES_PER_SIGMA * sqrtf(fmaxf(blob->shape_px2[2], 0)) + MARGIN_PX;

	place->left_px = fminf(place->left_px, blob->x_px - half_x);
	place->right_px = fmaxf(place->right_px, blob->x_px + half_x);
	place->top_px = fminf(place->top_px, blob->y_px - half_y);
	place->bottom_px = fmaxf(place->bottom_px, blob->y_px + half_y);
	place->seen_count += place->seen_in != set;
	place->seen_in = set;
}

void mask_finder_add(struct mask_finder *finder, const struct blob_set *set)
{
	finder->set_count++;
	finder->spot_count += set->blob_count;
	for (uint32_t b = 0; b < set->blob_count; b++) {
		struct mask_place *place = place_of(finder, &set->blobs[b]);

		if (place)
			see(place, &set->blobs[b], finder->set_count);
	}
}

static struct mask_area area_of(const struct mask_place *place, int width_px, int height_px)
{
	int left = (int)fmaxf(floorf(place->left_px), 0);
	int top = (int)fmaxf(floorf(place->top_px), 0);
	int right = (int)fminf(ceilf(place->right_px), (float)(width_px - 1));
	int bottom = (int)fminf(ceilf(place->bottom_px), (float)(height_px - 1));

	return (struct mask_area){left, top, right - left + 1, bottom - top + 1};
}

static struct mask_area join(const struct mask_area *a, const struct mask_area *b)
{
	int left = a->x_px < b->x_px ? a->x_px : b->x_px;
	int top = a->y_px < b->y_px ? a->y_px : b->y_px;
	int right_a = a->x_px + a->width_px, right_b = b->x_px + b->width_px;
	int bottom_a = a->y_px + a->height_px, bottom_b = b->y_px + b->height_px;

	return (struct mask_area){left, top, (right_a > right_b ? right_a : right_b) - left,
				  (bottom_a > bottom_b ? bottom_a : bottom_b) - top};
}

static int64_t size_px2(const struct mask_area *area)
{
	return (int64_t)area->width_px * area->height_px;
}

/* Joins the two areas that cost the fewest pixels more, if that is less than `most`. */
static int join_two(struct mask_area *areas, uint32_t *count, int64_t most_px2)
{
	int64_t least_px2 = most_px2;
	uint32_t first = 0, second = 0;

	for (uint32_t i = 0; i < *count; i++)
		for (uint32_t j = i + 1; j < *count; j++) {
			struct mask_area both = join(&areas[i], &areas[j]);
			int64_t cost_px2 =
				size_px2(&both) - size_px2(&areas[i]) - size_px2(&areas[j]);

			if (cost_px2 < least_px2) {
				least_px2 = cost_px2;
				first = i;
				second = j;
			}
		}
	if (!second)
		return 0;
	areas[first] = join(&areas[first], &areas[second]);
	areas[second] = areas[--*count];
	return 1;
}

struct mask_finding mask_finder_result(const struct mask_finder *finder, int width_px,
				       int height_px, struct mask *out)
{
	struct mask_area areas[MASK_PLACE_MAX];
	struct mask_finding finding = {0};
	uint32_t count = 0, steady_spots = 0;

	for (uint32_t p = 0; p < finder->place_count; p++) {
		const struct mask_place *place = &finder->places[p];

		if ((float)place->seen_count < STEADY_SHARE * (float)finder->set_count)
			continue;
		areas[count++] = area_of(place, width_px, height_px);
		steady_spots += place->seen_count;
	}
	finding.steady_count = count;
	if (finder->set_count && finder->spot_count > steady_spots)
		finding.unsteady_per_set =
			(double)(finder->spot_count - steady_spots) / finder->set_count;
	while (join_two(areas, &count, 1)) {
	}
	while (count > MASK_AREA_MAX && join_two(areas, &count, INT64_MAX)) {
	}
	out->area_count = count;
	memcpy(out->areas, areas, count * sizeof(areas[0]));
	return finding;
}
