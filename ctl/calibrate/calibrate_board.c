/*
 * stagectl calibrate board: a board to print, and the words that describe it to the station.
 */
#include <errno.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "base/exit_codes.h"
#include "base/output_file.h"
#include "calib/board/board_pdf.h"
#include "config/calibration.h"
#include "ctl/arguments.h"
#include "ctl/print_json.h"

struct wanted {
	const char *print, *save, *squares;
	double square_mm, distance_m, focal_px;
	uint64_t first_id;
	bool json;
};

/* "11x8" */
static bool read_squares(const char *text, struct board *board)
{
	int end = 0;

	if (sscanf(text, "%dx%d%n", &board->squares_x, &board->squares_y, &end) == 2 && !text[end])
		return true;
	fprintf(stderr, "stagectl: --squares %s: write columns x rows, as 11x8\n", text);
	return false;
}

static bool choose(const struct wanted *wanted, struct board *board)
{
	*board = BOARD_DEFAULT;
	if (wanted->squares && !read_squares(wanted->squares, board))
		return false;
	if ((wanted->distance_m > 0) != (wanted->focal_px > 0) ||
	    (wanted->square_mm > 0 && wanted->distance_m > 0)) {
		fprintf(stderr, "stagectl: give --square-mm, or --distance-m and --focal-px "
				"together\n");
		return false;
	}
	if (wanted->square_mm > 0)
		board->square_m = wanted->square_mm * 1e-3;
	if (wanted->distance_m > 0) /* to the next whole millimetre */
		board->square_m = 1e-3 * (double)(long)(1e3 * board_square_for(wanted->distance_m,
									       wanted->focal_px,
									       board->tag_part) +
							0.999);
	board->first_id =
		wanted->first_id > BOARD_TAG_COUNT ? BOARD_TAG_COUNT : (int)wanted->first_id;
	return true;
}

static int save(const char *path, const struct board *board, struct diag *diag)
{
	struct output_file file;
	int err = output_file_open(&file, path, diag);

	if (err)
		return err;
	fputs("# A calibration board; these keys also stand in a config's calibration.board.\n",
	      file.stream);
	board_print(file.stream, board);
	return output_file_commit(&file, diag);
}

static void report(const struct wanted *wanted, const struct board *board)
{
	if (wanted->json) {
		json_t *object = json_pack(
			"{s:s, s:i, s:i, s:f, s:f, s:i}", "file", wanted->print, "squares_x",
			board->squares_x, "squares_y", board->squares_y, "square_m",
			board->square_m, "tag_part", board->tag_part, "first_id", board->first_id);
		print_json(object);
		return;
	}
	printf("%s: %d x %d squares of %.1f mm\n", wanted->print, board->squares_x,
	       board->squares_y, 1e3 * board->square_m);
	puts("Print it at 100 % (not \"fit to page\"), in carbon black, on something stiff; then "
	     "measure both rulers.\nIn the config:");
	printf("calibration:\n  board: {squares_x: %d, squares_y: %d, square_m: %.9g, tag_part: "
	       "%.9g, first_id: %d}\n",
	       board->squares_x, board->squares_y, board->square_m, board->tag_part,
	       board->first_id);
}

static int run(const struct wanted *wanted, struct diag *diag)
{
	struct board board;

	if (!wanted->print) {
		fprintf(stderr, "stagectl: --print FILE is missing: where the PDF goes\n");
		return EXIT_CODE_USAGE;
	}
	if (!choose(wanted, &board))
		return EXIT_CODE_USAGE;
	int err = board_pdf_write(wanted->print, &board, diag);
	if (!err && wanted->save)
		err = save(wanted->save, &board, diag);
	if (err)
		return err == -EINVAL ? EXIT_CODE_USAGE : EXIT_CODE_INTERNAL;
	report(wanted, &board);
	return EXIT_CODE_OK;
}

int verb_calibrate_board(const struct verb *verb, int argc, char **argv)
{
	struct wanted wanted = {0};
	struct diag diag = {0};
	const struct argument arguments[] = {
		{"print", "FILE", "the PDF, true to scale", .text = &wanted.print},
		{"save", "FILE", "describe the board here, for --board", .text = &wanted.save},
		{"squares", "NxM", "columns and rows (default 11x8)", .text = &wanted.squares},
		{"square-mm", "MM", "edge of a square (default 60)", .number = &wanted.square_mm},
		{"distance-m", "M", "or: the farthest that a camera is from the board ...",
		 .number = &wanted.distance_m},
		{"focal-px", "PX", "... and the focal length of its lens in pixels",
		 .number = &wanted.focal_px},
		{"first-id", "N", "of the tags (default 0)", .count = &wanted.first_id},
		ARGUMENT_JSON(&wanted.json),
		{0},
	};
	enum arguments_result parsed = arguments_parse(verb, arguments, argc, argv, NULL, 0);

	if (parsed != ARGUMENTS_OK)
		return arguments_exit_code(parsed);
	int code = run(&wanted, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	return code;
}
