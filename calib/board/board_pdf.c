/*
 * The board's page as a file.
 */
#include "calib/board/board_pdf.h"

#include <cairo-pdf.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/output_file.h"
#include "calib/board/board_sheet.h"

#define POINTS_PER_M (72 / 0.0254)
#define PAGE_MAX_M 5.08 /* 200 inches: PDF's own limit */

static cairo_status_t put(void *file, const unsigned char *bytes, unsigned size)
{
	return fwrite(bytes, 1, size, file) == size ? CAIRO_STATUS_SUCCESS
						    : CAIRO_STATUS_WRITE_ERROR;
}

static int write_sheet(FILE *file, const struct board_sheet *sheet,
		       const struct board_pattern *pattern)
{
	cairo_surface_t *surface = cairo_pdf_surface_create_for_stream(
		put, file, sheet->width_m * POINTS_PER_M, sheet->height_m * POINTS_PER_M);
	cairo_t *cairo = cairo_create(surface);

	/* what every printer reads, and the size of the page is plain text */
	cairo_pdf_surface_restrict_to_version(surface, CAIRO_PDF_VERSION_1_4);
	cairo_scale(cairo, POINTS_PER_M, POINTS_PER_M);
	board_sheet_draw(cairo, sheet, pattern);
	cairo_destroy(cairo);
	cairo_surface_finish(surface);
	int err = 0;
	switch (cairo_surface_status(surface)) {
	case CAIRO_STATUS_SUCCESS:
		break;
	case CAIRO_STATUS_NO_MEMORY:
		err = -ENOMEM;
		break;
	default:
		err = errno ? -errno : -EIO;
	}
	cairo_surface_destroy(surface);
	return err;
}

static int check(const char *path, const struct board_sheet *sheet, struct diag *diag)
{
	if (sheet->width_m <= PAGE_MAX_M && sheet->height_m <= PAGE_MAX_M)
		return 0;
	diag_add(diag,
		 "%s: the board is %.2f x %.2f m; a page can be %.2f m: fewer or smaller squares",
		 path, sheet->width_m, sheet->height_m, PAGE_MAX_M);
	return -EINVAL;
}

int board_pdf_write(const char *path, const struct board *board, struct diag *diag)
{
	struct board_pattern *pattern = NULL;
	struct output_file output;
	int err = board_check(board, "board", diag);

	if (err)
		return err;
	struct board_sheet sheet = board_sheet_of(board);
	err = check(path, &sheet, diag);
	if (err)
		return err;
	err = output_file_open(&output, path, diag);
	if (err)
		return err;
	pattern = malloc(sizeof(*pattern));
	err = pattern ? board_pattern_init(pattern, board) : -ENOMEM;
	errno = 0;
	if (!err)
		err = write_sheet(output.stream, &sheet, pattern);
	free(pattern);
	return output_file_end(&output, err, diag);
}

double board_square_for(double range_m, double focal_px, double tag_part)
{
	double cell_m = BOARD_CELL_MIN_PX * range_m / focal_px;

	return cell_m * BOARD_TAG_CELLS / tag_part;
}
