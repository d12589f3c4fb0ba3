/*
 * The order in which spots become blobs: a step at a time while the scan still runs, so that the
 * arithmetic hides in the waits for memory; suspects when all is known.
 */
#include <limits.h>
#include <math.h>
#include <string.h>

#include "track/blobs/blobs_parts.h"

#define REACH_PX 8       /* and twice the spot: no window reaches further */
#define CROWD_SPOTS 1500 /* with more, an image is garbage and not worth the search */
#define TALL_PX 32       /* the parts of a taller spot below this are not looked out for */

void measurer_start(struct measurer *measurer, const struct spot_scene *scene,
		    struct run_table *table, struct blob_set *set)
{
	measurer->scene = *scene;
	measurer->table = table;
	measurer->set = set;
	measurer->next = measurer->first = 0;
	measurer->suspect_count = 0;
	measurer->fit_count = 0;
	measurer->wait_row = 0;
	set->blob_count = 0;
	set->blobs_lost = 0;
}

/* Squared distance from the middle of `spot` to where `other` begins, its faint border included. */
static float gap_px2(const struct spot *spot, const struct spot *other)
{
	float x = 0.5f * (float)(spot->x0 + spot->x1 - 1);
	float y = 0.5f * (float)(spot->y0 + spot->y1 - 1);
	float left = (float)(other->x0 - 1) - x, right = x - (float)other->x1;
	float above = (float)(other->y0 - 1) - y, below = y - (float)other->y1;
	float dx = left > right ? left : right, dy = above > below ? above : below;

	return (dx > 0 ? dx * dx : 0) + (dy > 0 ? dy * dy : 0);
}

/* Spots come in order of their top rows, so only a few of them can be near; but the parts of a
 * split spot stand at the end of the table, and may be near any. */
static float clearance_px(const struct measurer *measurer, uint32_t s)
{
	const struct spot *spots = measurer->table->spots, *spot = &spots[s];
	int width = spot->x1 - spot->x0, height = spot->y1 - spot->y0;
	int reach = 2 * (width > height ? width : height) + REACH_PX;
	bool part = s >= measurer->first && measurer->first;
	uint32_t i = part ? 0 : s;
	float least = (float)(reach * reach);

	if (measurer->table->spot_count > CROWD_SPOTS)
		return 0;
	while (i > 0 && spots[i - 1].y0 + TALL_PX > spot->y0)
		i--;
	for (; i < measurer->table->spot_count; i++) {
		const struct spot *other = &spots[i];
		float gap;

		if (!part && other->y0 > spot->y1 + reach)
			break;
		if (other->x0 > spot->x1 + reach || spot->x0 > other->x1 + reach || i == s ||
		    !other->area_px2)
			continue;
		gap = gap_px2(spot, other);
		least = gap < least ? gap : least;
	}
	return sqrtf(least);
}

/* From the window to the blob; keeps the place that it is sorted by. */
static void finish(struct measurer *measurer, const struct spot *spot, struct fit *fit)
{
	struct blob_set *set = measurer->set;
	struct blob spare,
		*blob = set->blob_count < BLOB_MAX ? &set->blobs[set->blob_count] : &spare;

	spot_step(&measurer->scene, fit);
	if (!spot_finish(spot, &measurer->scene, fit, blob))
		return;
	if (blob == &spare) {
		set->blobs_lost++;
		return;
	}
	measurer->top_px[set->blob_count] = spot->y0;
	measurer->left_px[set->blob_count] = spot->x0;
	set->blob_count++;
}

/* Measures the spots that wait. */
static void finish_all(struct measurer *measurer)
{
	const struct spot *spots = measurer->table->spots;
	uint32_t count = measurer->fit_count;

	measurer->fit_count = 0;
	for (uint32_t first = 0; first < count; first += FIT_LANES) {
		struct fit *fits = measurer->fits + first;
		uint32_t lanes = count - first < FIT_LANES ? count - first : FIT_LANES;

		spot_prepare(&measurer->scene, spots, fits, lanes);
		for (uint32_t i = 0; i < lanes; i++)
			finish(measurer, &spots[fits[i].spot], &fits[i]);
	}
}

/* The spot is measured when enough of them wait, as the way to a window is long and the same for
 * all. */
static void measure(struct measurer *measurer, uint32_t s)
{
	const struct spot *spot = &measurer->table->spots[s];
	struct fit *fit = &measurer->fits[measurer->fit_count++];

	fit->spot = s;
	fit->copy = &measurer->table->copies[s % COPY_COUNT];
	fit->clear_px = spot->clear_px > 0 ? spot->clear_px : clearance_px(measurer, s);
	if (measurer->fit_count == FITS_WAITING)
		finish_all(measurer);
}

/* The row that must have been read before the spot is whole, its window known, and its background
 * in reach. */
static int ready_row(const struct spot *spot)
{
	int whole = spot->y1 + (spot->y1 - spot->y0) / 2 + 2 + MEASURE_LAG_ROWS;
	int known = (spot->y0 + spot->y1) / 2 + NODE_REACH_PX;

	if (spot->clear_px > 0)
		return spot->y0 + PATCH_PX - PATCH_ABOVE;
	return whole > known ? whole : known;
}

/* The next spot that is ready: measured, or put aside as suspect. */
bool measurer_step(struct measurer *measurer, int row_read)
{
	struct spot *spot = &measurer->table->spots[measurer->next];
	uint32_t s;

	if (row_read < measurer->wait_row || measurer->next == measurer->table->spot_count)
		return false;
	measurer->wait_row = ready_row(spot);
	if (measurer->wait_row > row_read)
		return false;
	s = measurer->next++;
	if (!spot->area_px2)
		return true;
	if (measurer->set->blob_count == BLOB_MAX) {
		measurer->set->blobs_lost++;
		return true;
	}
	if (!(spot->clear_px > 0))
		spot_sum(spot, measurer->table->runs, measurer->scene.image);
	if (spot_is_suspect(spot) && !spot_is_surely_one(spot, measurer->scene.image))
		measurer->suspects[measurer->suspect_count++] = s;
	else
		measure(measurer, s);
	return true;
}

/* Blobs come nearly in order: each moves up past the few that begin below it. */
static void sort_blobs(struct measurer *measurer)
{
	int *top = measurer->top_px, *left = measurer->left_px;
	struct blob *blobs = measurer->set->blobs;

	for (uint32_t i = 1; i < measurer->set->blob_count; i++) {
		struct blob blob = blobs[i];
		int t = top[i], l = left[i];
		uint32_t j = i;

		for (; j > 0 && (top[j - 1] > t || (top[j - 1] == t && left[j - 1] > l)); j--) {
			blobs[j] = blobs[j - 1];
			top[j] = top[j - 1];
			left[j] = left[j - 1];
		}
		blobs[j] = blob;
		top[j] = t;
		left[j] = l;
	}
}

void measurer_end(struct measurer *measurer)
{
	while (measurer_step(measurer, INT_MAX)) {
	}
	finish_all(measurer);
	measurer->first = measurer->table->spot_count;
	for (uint32_t i = 0; i < measurer->suspect_count; i++) {
		if (spot_split(measurer->table, measurer->suspects[i], &measurer->scene))
			measure(measurer, measurer->suspects[i]);
		while (measurer_step(measurer, INT_MAX)) {
		}
		finish_all(measurer);
	}
	measurer->set->blobs_lost += measurer->table->runs_lost + measurer->table->spots_lost;
	sort_blobs(measurer);
}
