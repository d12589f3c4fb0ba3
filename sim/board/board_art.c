/*
 * Shares of rows and columns multiply: the blur is taken along the board's own axes, which is exact
 * for its edges and symmetrical about its corners.
 */
#include "sim/board/board_art.h"

#define TABLE_END 4.0f

int board_art_init(struct board_art *art, const struct sim_board *board)
{
	const struct board *print = &board->print;
	double edge_m = print->square_m + board->margin_m; /* from the outermost corners */

	for (int k = 0; k < 2; k++) {
		int corners = k == 0 ? board_corners_x(print) : board_corners_y(print);

		art->low_m[k] = (float)-edge_m;
		art->high_m[k] = (float)(print->square_m * (corners - 1) + edge_m);
	}
	for (int i = 0; i <= BOARD_ART_TABLE; i++)
		art->cumulative[i] = (float)(0.5 * erfc((double)TABLE_END * M_SQRT1_2 *
							(1 - 2.0 * i / BOARD_ART_TABLE)));
	return board_pattern_init(&art->pattern, print);
}

/* Share of a unit Gaussian left of `sigmas`. */
static float share_left(const struct board_art *art, float sigmas)
{
	float place = (sigmas + TABLE_END) * (0.5f * BOARD_ART_TABLE / TABLE_END);

	if (place <= 0)
		return 0;
	if (place >= BOARD_ART_TABLE)
		return 1;
	int cell = (int)place;

	return art->cumulative[cell] +
	       (place - (float)cell) * (art->cumulative[cell + 1] - art->cumulative[cell]);
}

/* How a blurred place is shared by the two squares beside the nearest line between squares, along
 * one axis; `place` and `sigma` in squares. Squares that do not exist have no share. */
struct split {
	int index[2];
	float share[2];
};

static struct split split_squares(const struct board_art *art, float place, float sigma, int count)
{
	int line = (int)floorf(place + 0.5f);
	float behind = share_left(art, (place - (float)line) / sigma);
	struct split split = {{line - 1, line}, {1 - behind, behind}};

	for (int k = 0; k < 2; k++)
		if (split.index[k] < 0 || split.index[k] >= count)
			split.share[k] = 0;
	return split;
}

/* Shares of a tag's cells along one axis; returns how many, from *first on. */
static int split_cells(const struct board_art *art, float place, float sigma,
		       float shares[BOARD_TAG_CELLS], int *first)
{
	float reach = 3.2f * sigma;
	int low = (int)floorf(place - reach), high = (int)floorf(place + reach);

	low = low < 0 ? 0 : low;
	high = high > BOARD_TAG_CELLS - 1 ? BOARD_TAG_CELLS - 1 : high;
	*first = low;
	if (high < low)
		return 0;
	float before = share_left(art, ((float)low - place) / sigma);

	for (int i = low; i <= high; i++) {
		float until = share_left(art, ((float)(i + 1) - place) / sigma);

		shares[i - low] = until - before;
		before = until;
	}
	return high - low + 1;
}

static float tag_ink(const struct board_art *art, const float place[2], const float sigma[2])
{
	const struct board *print = &art->pattern.board;
	const float cells = (float)(BOARD_TAG_CELLS / print->tag_part);
	const float start = (float)(0.5 * (1 - print->tag_part));
	int column = (int)floorf(place[0]), row = (int)floorf(place[1]);
	float across[BOARD_TAG_CELLS], down[BOARD_TAG_CELLS], ink = 0;
	int x0, y0;

	if (column < 0 || row < 0 || column >= print->squares_x || row >= print->squares_y ||
	    board_square_is_black(column, row))
		return 0;
	const uint8_t(*tag)[BOARD_TAG_CELLS_ALL] =
		art->pattern.cells[(row * print->squares_x + column) / 2];
	int width = split_cells(art, (place[0] - (float)column - start) * cells, sigma[0] * cells,
				across, &x0);
	int height = split_cells(art, (place[1] - (float)row - start) * cells, sigma[1] * cells,
				 down, &y0);

	for (int y = 0; y < height; y++) {
		const uint8_t *cell = &tag[1 + y0 + y][1 + x0]; /* past the white rim */
		float sum = 0;

		for (int x = 0; x < width; x++)
			sum += cell[x] ? across[x] : 0;
		ink += sum * down[y];
	}
	return ink;
}

/* Along axis k, share of the blurred place that is on the plate. */
static float plate_share(const struct board_art *art, int k, float place_m, float sigma_m)
{
	return share_left(art, (art->high_m[k] - place_m) / sigma_m) -
	       share_left(art, (art->low_m[k] - place_m) / sigma_m);
}

float board_art_ink(const struct board_art *art, const float xy_m[2], const float sigma_m[2],
		    float *board_share)
{
	const struct board *print = &art->pattern.board;
	float scale = (float)(1 / print->square_m);
	float place[2] = {xy_m[0] * scale + 1, xy_m[1] * scale + 1};
	float sigma[2] = {sigma_m[0] * scale, sigma_m[1] * scale};

	*board_share =
		plate_share(art, 0, xy_m[0], sigma_m[0]) * plate_share(art, 1, xy_m[1], sigma_m[1]);
	if (*board_share <= 0)
		return 0;
	struct split x = split_squares(art, place[0], sigma[0], print->squares_x);
	struct split y = split_squares(art, place[1], sigma[1], print->squares_y);
	float ink = tag_ink(art, place, sigma);

	for (int j = 0; j < 2; j++)
		for (int i = 0; i < 2; i++)
			if (board_square_is_black(x.index[i], y.index[j]))
				ink += x.share[i] * y.share[j];
	return ink;
}
