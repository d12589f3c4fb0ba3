/*
 * The corner finder's verdicts, sorted and counted.
 */
#include "ctl/calibrate/calibrate_search.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

#define TOGETHER_NS (200 * NS_PER_US) /* cameras whose middles of exposure differ by less */
#define MIRROR_TRIES 3
#define TRY_SMALL_EVERY 4
#define SMALL_SQUARE_PX 32 /* whose tags are not read at half the size */
#define SAMPLE_STEP_PX 8   /* of the pixels that tell whether a picture has changed */
#define CHANGE_GREY 24     /* more than the noise */
#define CHANGED_MIN 16     /* pixels: a board far away that moved by some of its own */

/* A board that one camera saw. */
struct found_view {
	uint32_t camera;
	uint64_t shot;
	int64_t mid_exposure_ns;
	double (*px)[2]; /* owned */
};

int view_search_init(struct view_search *search, uint32_t camera, const struct board *board,
		     const struct view_search_settings *settings)
{
	struct corner_settings corners = CORNER_SETTINGS_DEFAULT;

	corners.blur_max_px = settings->blur_max_px;
	corners.thorough = settings->thorough;
	*search = (struct view_search){.settings = *settings,
				       .camera = camera,
				       .corner_count = (uint32_t)board_corner_count(board)};
	return corner_finder_create(&search->finder, board, &corners);
}

void view_search_finish(struct view_search *search)
{
	corner_finder_destroy(search->finder);
	for (uint32_t i = 0; i < search->found_count; i++)
		free(search->found[i].px);
	free(search->found);
	free(search->blurs_px);
	free(search->last);
	grey_room_finish(&search->grey);
	*search = (struct view_search){0};
}

static int grow(void **list, uint32_t *capacity, uint32_t count, size_t item_bytes)
{
	if (count < *capacity)
		return 0;
	uint32_t wanted = *capacity ? 2 * *capacity : 64;
	void *larger = realloc(*list, wanted * item_bytes);
	if (!larger)
		return -ENOMEM;
	*list = larger;
	*capacity = wanted;
	return 0;
}

static int keep_blur(struct view_search *s)
{
	int err = grow((void **)&s->blurs_px, &s->blur_capacity, s->blur_count, sizeof(double));

	if (!err)
		s->blurs_px[s->blur_count++] = s->corners.blur_px;
	return err;
}

static int keep_view(struct view_search *s, const struct frame *frame)
{
	size_t bytes = s->corner_count * sizeof(double[2]);
	int err = grow((void **)&s->found, &s->found_capacity, s->found_count,
		       sizeof(struct found_view));
	double(*px)[2] = err ? NULL : malloc(bytes);

	if (!px)
		return -ENOMEM;
	memcpy(px, s->corners.px, bytes);
	s->found[s->found_count++] =
		(struct found_view){s->camera, frame->shot, frame->mid_exposure_ns, px};
	return 0;
}

/* Of a camera that has not seen the board yet: the first few pictures, then ever fewer. */
static int look_in_mirror(struct view_search *s, const struct grey_image *image)
{
	uint32_t without = s->counts.without;

	if (s->counts.good || s->counts.mirrored ||
	    (without > MIRROR_TRIES && (without & (without - 1))))
		return 0;
	return corner_finder_is_mirrored(s->finder, image, &s->counts.mirrored);
}

static int sort_picture(struct view_search *s, const struct grey_image *image,
			const struct frame *frame)
{
	int err;

	s->counts.pictures++;
	switch (s->corners.state) {
	case CORNERS_GOOD:
		s->counts.good++;
		err = keep_blur(s);
		return err ? err : keep_view(s, frame);
	case CORNERS_NO_BOARD:
		s->counts.without++;
		return look_in_mirror(s, image);
	case CORNERS_FEW:
		s->counts.few++;
		return 0;
	case CORNERS_BLURRED:
		s->counts.blurred++;
		return keep_blur(s);
	case CORNERS_OTHER_BOARD:
		s->counts.other++;
		return 0;
	}
	return 0;
}

/* Takes the samples of the picture in the last one's place. Returns 1 when it shows something else
 * than that, 0, or -ENOMEM. */
static int has_changed(struct view_search *s, const struct grey_image *image)
{
	int columns = image->width_px / SAMPLE_STEP_PX, rows = image->height_px / SAMPLE_STEP_PX;
	int changed = s->last ? 0 : CHANGED_MIN;

	if (!s->last)
		s->last = malloc((size_t)columns * (size_t)rows + 1);
	if (!s->last)
		return -ENOMEM;
	uint8_t *last = s->last;
	for (int y = 0; y < rows; y++) {
		const uint8_t *row =
			image->pixels + (ptrdiff_t)y * SAMPLE_STEP_PX * image->stride_bytes;

		for (int x = 0; x < columns; x++, last++)
			changed += abs(row[x * SAMPLE_STEP_PX] - *last) > CHANGE_GREY;
	}
	if (changed < CHANGED_MIN)
		return 0;
	for (int y = 0; y < rows; y++)
		for (int x = 0; x < columns; x++)
			s->last[y * columns + x] =
				image->pixels[(ptrdiff_t)y * SAMPLE_STEP_PX * image->stride_bytes +
					      x * SAMPLE_STEP_PX];
	return 1;
}

/* Pictures at half their size take a sixth of the time. Where that shows no board, every few
 * pictures are searched at their own size, and all of them once it is known to be small. */
static int find_corners(struct view_search *s, const struct grey_image *image)
{
	uint32_t in_vain = s->counts.without + s->counts.few;

	if (!s->settings.thorough)
		corner_finder_set_thorough(s->finder, s->small || in_vain % TRY_SMALL_EVERY == 0);
	int err = corner_finder_run(s->finder, image, &s->corners);
	if (!err && s->corners.state == CORNERS_GOOD)
		s->small = s->corners.square_px < SMALL_SQUARE_PX;
	return err;
}

int view_search_run(struct view_search *search, const struct frame *frame)
{
	struct picture_counts *counts = &search->counts;
	struct grey_image image;

	if (!counts->width_px) {
		counts->width_px = frame->width_px;
		counts->height_px = frame->height_px;
	}
	int err = frame->width_px == counts->width_px && frame->height_px == counts->height_px
			  ? picture_grey(&search->grey, frame, &image)
			  : -EBADMSG;
	if (err) {
		counts->damaged += err == -EBADMSG;
		return err == -EBADMSG ? 0 : err;
	}
	int changed = search->settings.thorough ? 1 : has_changed(search, &image);
	if (changed <= 0) {
		counts->unchanged += changed == 0;
		return changed;
	}
	err = find_corners(search, &image);
	return err ? err : sort_picture(search, &image, frame);
}

static int compare_px(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

static int compare_found(const void *a, const void *b)
{
	const struct found_view *x = a, *y = b;

	if (x->shot != y->shot)
		return x->shot < y->shot ? -1 : 1;
	if (x->mid_exposure_ns != y->mid_exposure_ns)
		return x->mid_exposure_ns < y->mid_exposure_ns ? -1 : 1;
	return (x->camera > y->camera) - (x->camera < y->camera);
}

/* Cameras that exposed together share a pose. One that exposed apart saw the board elsewhere. */
static int add_all(struct observations *o, const struct found_view *all, uint32_t count,
		   struct picture_counts *counts)
{
	uint32_t pose = 0;
	int err = 0;

	for (uint32_t i = 0, first = 0; i < count && !err; i++) {
		bool same_shot = all[i].shot == all[first].shot;
		int64_t apart_ns = all[i].mid_exposure_ns - all[first].mid_exposure_ns;

		if (i > 0 && (!same_shot || apart_ns > TOGETHER_NS)) {
			if (same_shot && all[i].shot != UINT64_MAX) {
				struct picture_counts *k = &counts[all[i].camera];
				k->apart++;
				k->apart_ms = fmax(k->apart_ms, 1e-6 * (double)apart_ns);
			}
			first = i;
			pose++;
		}
		err = observations_add(o, all[i].camera, pose, (const double(*)[2])all[i].px);
		if (err == -EEXIST)
			err = 0; /* a picture that is there twice */
	}
	return err;
}

static void take_counts(struct picture_counts *counts, struct view_search *search)
{
	*counts = search->counts;
	qsort(search->blurs_px, search->blur_count, sizeof(double), compare_px);
	counts->blur_px = search->blur_count ? search->blurs_px[search->blur_count / 2] : NAN;
}

int views_put_together(struct observations *observations, struct view_search *const *searches,
		       struct picture_counts *counts)
{
	uint32_t count = 0;

	for (uint32_t c = 0; c < observations->camera_count; c++)
		count += searches[c]->found_count;
	struct found_view *all = calloc(count + 1, sizeof(*all));
	if (!all)
		return -ENOMEM;
	count = 0;
	for (uint32_t c = 0; c < observations->camera_count; c++) {
		if (searches[c]->found_count)
			memcpy(&all[count], searches[c]->found,
			       searches[c]->found_count * sizeof(*all));
		count += searches[c]->found_count;
		take_counts(&counts[c], searches[c]);
	}
	qsort(all, count, sizeof(*all), compare_found);
	int err = add_all(observations, all, count, counts);
	free(all);
	return err;
}
