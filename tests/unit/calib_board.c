/*
 * The board that is printed is the board that is found, and has its size.
 */
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/file.h"
#include "calib/board/board_pdf.h"
#include "calib/board/board_sheet.h"
#include "calib/board/corners.h"

#define PX_PER_M 1500.0

/* The page as a picture; pixel (0,0)'s centre is half a pixel from its corner. */
static uint8_t *picture_of(const struct board_sheet *sheet, struct grey_image *image)
{
	static struct board_pattern pattern;
	int width_px = (int)(sheet->width_m * PX_PER_M),
	    height_px = (int)(sheet->height_m * PX_PER_M);
	cairo_surface_t *surface =
		cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px);
	cairo_t *cairo = cairo_create(surface);
	uint8_t *pixels = malloc((size_t)(width_px * height_px));

	assert_non_null(pixels);
	assert_int_equal(board_pattern_init(&pattern, sheet->board), 0);
	cairo_scale(cairo, PX_PER_M, PX_PER_M);
	board_sheet_draw(cairo, sheet, &pattern);
	cairo_surface_flush(surface);
	const uint8_t *data = cairo_image_surface_get_data(surface);
	int stride = cairo_image_surface_get_stride(surface);
	for (int y = 0; y < height_px; y++)
		for (int x = 0; x < width_px; x++)
			pixels[y * width_px + x] = data[y * stride + 4 * x];
	assert_int_equal(cairo_status(cairo), CAIRO_STATUS_SUCCESS);
	cairo_destroy(cairo);
	cairo_surface_destroy(surface);
	*image = (struct grey_image){pixels, width_px, height_px, width_px, 8};
	return pixels;
}

static void a_printed_board_is_found_true_to_scale(void **state)
{
	(void)state;
	struct corner_settings settings = CORNER_SETTINGS_DEFAULT;
	struct board board = {
		.squares_x = 9, .squares_y = 6, .square_m = 0.04, .tag_part = 0.7, .first_id = 100};
	struct board_sheet sheet = board_sheet_of(&board);
	struct corner_finder *finder;
	static struct corners corners;
	struct grey_image image;
	uint8_t *pixels = picture_of(&sheet, &image);

	assert_int_equal(corner_finder_create(&finder, &board, &settings), 0);
	assert_int_equal(corner_finder_run(finder, &image, &corners), 0);
	assert_int_equal(corners.tag_count, board_tag_count(&board));
	assert_int_equal(corners.found_count, board_corner_count(&board));
	for (int i = 0; i < board_corner_count(&board); i++) {
		struct vec3 p = board_corner_m(&board, i);
		double x_m = sheet.left_m + board.square_m + p.x;
		double y_m = sheet.top_m + board.square_m + p.y;

		/* edges are drawn on whole pixels */
		assert_float_equal(corners.px[i][0], x_m * PX_PER_M - 0.5, 0.6);
		assert_float_equal(corners.px[i][1], y_m * PX_PER_M - 0.5, 0.6);
	}
	corner_finder_destroy(finder);
	free(pixels);
}

static void the_page_has_the_boards_size(void **state)
{
	(void)state;
	char path[] = "/tmp/calib_boardXXXXXX";
	struct board board = BOARD_DEFAULT;
	struct diag diag = {0};
	double box[4];
	char *text;
	size_t size;
	int fd = mkstemp(path);

	assert_true(fd >= 0);
	close(fd);
	assert_int_equal(board_pdf_write(path, &board, &diag), 0);
	assert_int_equal(file_read(&text, &size, path, 1 << 20, NULL), 0);
	assert_memory_equal(text, "%PDF-", 5);
	const char *at = memmem(text, size, "/MediaBox [", 11);
	assert_non_null(at);
	assert_int_equal(
		sscanf(at, "/MediaBox [ %lf %lf %lf %lf", &box[0], &box[1], &box[2], &box[3]), 4);
	struct board_sheet sheet = board_sheet_of(&board);
	assert_float_equal(box[2] / 72 * 0.0254, sheet.width_m, 1e-5);
	assert_float_equal(box[3] / 72 * 0.0254, sheet.height_m, 1e-5);
	assert_true(sheet.width_m > board.squares_x * board.square_m);
	free(text);
	unlink(path);
}

static void boards_that_cannot_be_printed_are_refused(void **state)
{
	(void)state;
	struct board board = BOARD_DEFAULT;
	struct diag diag = {0};

	board.square_m = 0.6;
	assert_int_equal(board_pdf_write("/tmp/calib_board.pdf", &board, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "a page can be"));
	diag_finish(&diag);
	board = BOARD_DEFAULT;
	assert_int_equal(board_pdf_write("/nowhere/board.pdf", &board, &diag), -ENOENT);
	assert_non_null(strstr(diag.text, "/nowhere/board.pdf: cannot write"));
	diag_finish(&diag);
}

static void squares_suit_the_camera(void **state)
{
	(void)state;
	/* 2.5 px a cell at 4 m with 900 px of focal length */
	assert_float_equal(board_square_for(4, 900, 0.7), 0.127, 0.001);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_printed_board_is_found_true_to_scale),
		cmocka_unit_test(the_page_has_the_boards_size),
		cmocka_unit_test(boards_that_cannot_be_printed_are_refused),
		cmocka_unit_test(squares_suit_the_camera),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
