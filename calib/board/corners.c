/*
 * From tags to the corners beside them, and from there to the crossing of edges.
 */
#include "calib/board/corners.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/sort.h"
#include "calib/board/homography.h"
#include "calib/board/saddle.h"
#include "calib/board/tags.h"

#define TAGS_ENOUGH 6      /* fewer in the smaller picture: it may be too small */
#define DISAGREE_PART 0.12 /* of a square, between what two tags say of a corner */

struct corner_finder {
	struct board board;
	struct corner_settings settings;
	struct tag_finder *tag_finder;
	struct tags tags;
	double blurs[BOARD_CORNER_MAX], squares[BOARD_CORNER_MAX];
};

int corner_finder_create(struct corner_finder **out, const struct board *board,
			 const struct corner_settings *settings)
{
	struct corner_finder *finder;

	if (board_check(board, "board", NULL))
		return -EINVAL;
	finder = calloc(1, sizeof(*finder));
	if (!finder)
		return -ENOMEM;
	finder->board = *board;
	finder->settings = *settings;
	int err = tag_finder_create(&finder->tag_finder, board);
	if (err)
		free(finder);
	else
		*out = finder;
	return err;
}

void corner_finder_destroy(struct corner_finder *finder)
{
	if (!finder)
		return;
	tag_finder_destroy(finder->tag_finder);
	free(finder);
}

void corner_finder_set_thorough(struct corner_finder *finder, bool thorough)
{
	finder->settings.thorough = thorough;
}

/* The two tags at a corner: in its upper right and lower left square, or in the other two. -1: none
 * there. */
static void tags_at_corner(const struct board *board, int corner, int tags[2])
{
	int column = corner % board_corners_x(board), row = corner / board_corners_x(board);
	bool first_black = board_square_is_black(column, row);

	tags[0] = board_tag_in_square(board, first_black ? column + 1 : column, row);
	tags[1] = board_tag_in_square(board, first_black ? column : column + 1, row + 1);
}

/* Where one tag says the corner is, and how long a square's edges are there. */
static bool guess_from_tag(struct saddle_guess *guess, const struct tag *tag,
			   const struct board *board, int corner)
{
	struct vec3 at = board_corner_m(board, corner);
	double step_m = 0.05 * board->square_m;
	double x_px[2], y_px[2];

	if (!tag->found || !homography_apply(tag->h, (double[2]){at.x, at.y}, guess->px) ||
	    !homography_apply(tag->h, (double[2]){at.x + step_m, at.y}, x_px) ||
	    !homography_apply(tag->h, (double[2]){at.x, at.y + step_m}, y_px))
		return false;
	for (int k = 0; k < 2; k++) {
		guess->along_x_px[k] = (x_px[k] - guess->px[k]) * 20;
		guess->along_y_px[k] = (y_px[k] - guess->px[k]) * 20;
	}
	return true;
}

enum guessed { GUESS_NONE, GUESS_GOOD, GUESS_CONTRADICTED };

static enum guessed guess_corner(const struct corner_finder *finder, int corner,
				 struct saddle_guess *guess)
{
	struct saddle_guess each[2];
	int tags[2], count = 0;

	tags_at_corner(&finder->board, corner, tags);
	for (int i = 0; i < 2; i++)
		count += guess_from_tag(&each[count], &finder->tags.tags[tags[i]], &finder->board,
					corner);
	if (!count)
		return GUESS_NONE;
	*guess = each[0];
	if (count < 2)
		return GUESS_GOOD;
	if (hypot(each[0].px[0] - each[1].px[0], each[0].px[1] - each[1].px[1]) >
	    DISAGREE_PART * saddle_edge_px(&each[0]))
		return GUESS_CONTRADICTED;
	for (int k = 0; k < 2; k++) {
		guess->px[k] = (each[0].px[k] + each[1].px[k]) / 2;
		guess->along_x_px[k] = (each[0].along_x_px[k] + each[1].along_x_px[k]) / 2;
		guess->along_y_px[k] = (each[0].along_y_px[k] + each[1].along_y_px[k]) / 2;
	}
	return GUESS_GOOD;
}

/* Black and white in the corner's first square, as the board has them. */
static bool has_colours(const struct board *board, int corner, const struct saddle *saddle)
{
	int column = corner % board_corners_x(board), row = corner / board_corners_x(board);

	return board_square_is_black(column, row) == (saddle->contrast > 0);
}

static double median(double *values, uint32_t count)
{
	if (!count)
		return 0;
	sort_doubles(values, count);
	return values[count / 2];
}

/* Returns how many corners two tags contradict each other about. */
static uint32_t measure_corners(struct corner_finder *finder, const struct grey_image *image,
				struct corners *corners)
{
	uint32_t contradicted = 0, found = 0;

	for (int i = 0; i < board_corner_count(&finder->board); i++) {
		struct saddle_guess guess;
		struct saddle saddle;
		enum guessed guessed = guess_corner(finder, i, &guess);

		contradicted += guessed == GUESS_CONTRADICTED;
		if (guessed != GUESS_GOOD || saddle_fit(&saddle, image, &guess) ||
		    !has_colours(&finder->board, i, &saddle))
			continue;
		memcpy(corners->px[i], saddle.px, sizeof(saddle.px));
		finder->squares[found] = saddle_edge_px(&guess);
		finder->blurs[found++] = fmax(saddle.blur_px[0], saddle.blur_px[1]);
	}
	corners->found_count = found;
	corners->blur_px = median(finder->blurs, found);
	corners->square_px = median(finder->squares, found);
	return contradicted;
}

static enum corners_state judge(const struct corner_finder *finder, const struct corners *corners,
				uint32_t contradicted)
{
	if (corners->foreign_count > corners->tag_count || contradicted > corners->found_count)
		return CORNERS_OTHER_BOARD;
	if (!corners->tag_count)
		return CORNERS_NO_BOARD;
	if (corners->blur_px > finder->settings.blur_max_px)
		return CORNERS_BLURRED;
	return corners->found_count < finder->settings.corners_min ? CORNERS_FEW : CORNERS_GOOD;
}

int corner_finder_run(struct corner_finder *finder, const struct grey_image *image,
		      struct corners *corners)
{
	int err = tag_finder_run(finder->tag_finder, image, 2, &finder->tags);

	if (!err && finder->tags.found_count < TAGS_ENOUGH && finder->settings.thorough)
		err = tag_finder_run(finder->tag_finder, image, 1, &finder->tags);
	if (err)
		return err;
	corners->tag_count = finder->tags.found_count;
	corners->foreign_count = finder->tags.foreign_count;
	for (int i = 0; i < BOARD_CORNER_MAX; i++)
		corners->px[i][0] = corners->px[i][1] = NAN;
	uint32_t contradicted = measure_corners(finder, image, corners);
	corners->state = judge(finder, corners, contradicted);
	return 0;
}

int corner_finder_is_mirrored(struct corner_finder *finder, const struct grey_image *image,
			      bool *mirrored)
{
	size_t width = (size_t)image->width_px, height = (size_t)image->height_px;
	uint8_t *pixels = malloc(width * height);

	if (!pixels)
		return -ENOMEM;
	for (size_t y = 0; y < height; y++)
		for (size_t x = 0; x < width; x++)
			pixels[y * width + x] =
				image->pixels[y * (size_t)image->stride_bytes + width - 1 - x];
	struct grey_image flipped = {pixels, image->width_px, image->height_px, image->width_px, 8};
	int err = tag_finder_run(finder->tag_finder, &flipped, 1, &finder->tags);
	free(pixels);
	if (!err)
		*mirrored = finder->tags.found_count > 0;
	return err;
}
