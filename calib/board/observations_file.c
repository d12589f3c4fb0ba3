/*
 * corners.vnl with a heading.
 */
#include "calib/board/observations_file.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/output_file.h"

#define BOARD_KEY "# stage-board "
#define CAMERA_KEY "# stage-camera "

static void print_views(FILE *file, const struct observations *o)
{
	for (uint32_t v = 0; v < o->view_count; v++)
		for (uint32_t i = 0; i < o->corner_count; i++) {
			const double *px = observations_px(o, v)[i];

			fprintf(file, "%s-%06u.png ", o->cameras[o->views[v].camera].name,
				o->views[v].pose);
			if (isnan(px[0] + px[1]))
				fprintf(file, "- - -\n");
			else
				fprintf(file, "%.17g %.17g 0\n", px[0], px[1]);
		}
}

int observations_write(const struct observations *observations, const char *path, struct diag *diag)
{
	const struct board *board = &observations->board;
	struct output_file output;
	int err = output_file_open(&output, path, diag);

	if (err)
		return err;
	FILE *file = output.stream;
	fprintf(file, BOARD_KEY "%d %d %.17g %.17g %d\n", board->squares_x, board->squares_y,
		board->square_m, board->tag_part, board->first_id);
	for (uint32_t c = 0; c < observations->camera_count; c++)
		fprintf(file, CAMERA_KEY "%s %d %d\n", observations->cameras[c].name,
			observations->cameras[c].width_px, observations->cameras[c].height_px);
	fprintf(file, "# filename x y level\n");
	print_views(file, observations);
	return output_file_commit(&output, diag);
}

struct reader {
	const char *path;
	FILE *file;
	struct diag *diag;
	int line_number;
	char *line; /* owned; without its newline */
	size_t line_size;
	struct board board;
	bool has_board;
	uint32_t camera_count;
	struct observed_camera cameras[CAMERA_MAX];
	struct observations observations;
	bool started;    /* observations are there: the heading is over */
	uint32_t corner; /* the next of the view; 0: a new one */
	uint32_t camera, pose;
	char name[NAME_BYTES + 32]; /* of the view */
	double (*px)[2];            /* owned */
};

static int complain(struct reader *r, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

static int complain(struct reader *r, const char *format, ...)
{
	char text[200];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	diag_add(r->diag, "%s:%d: %s", r->path, r->line_number, text);
	return -EINVAL;
}

static int read_board(struct reader *r, const char *text)
{
	struct board board = {0};
	int end = 0;

	if (sscanf(text, "%d %d %lf %lf %d%n", &board.squares_x, &board.squares_y, &board.square_m,
		   &board.tag_part, &board.first_id, &end) != 5 ||
	    text[end])
		return complain(r, "expected squares_x squares_y square_m tag_part first_id");
	r->board = board;
	r->has_board = true;
	return 0;
}

static int read_camera(struct reader *r, const char *text)
{
	struct observed_camera *camera = &r->cameras[r->camera_count];
	int end = 0;

	if (r->camera_count == CAMERA_MAX)
		return complain(r, "more than %d cameras", CAMERA_MAX);
	memset(camera, 0, sizeof(*camera));
	if (sscanf(text, "%63[A-Za-z0-9_-] %d %d%n", camera->name, &camera->width_px,
		   &camera->height_px, &end) != 3 ||
	    text[end])
		return complain(r, "expected a camera's name, width and height");
	r->camera_count++;
	return 0;
}

static int read_heading(struct reader *r)
{
	if (!strncmp(r->line, BOARD_KEY, strlen(BOARD_KEY)))
		return r->has_board ? complain(r, "a second board")
				    : read_board(r, r->line + strlen(BOARD_KEY));
	if (!strncmp(r->line, CAMERA_KEY, strlen(CAMERA_KEY)))
		return r->started ? complain(r, "a camera behind the first view")
				  : read_camera(r, r->line + strlen(CAMERA_KEY));
	return 0;
}

/* At the first view. */
static int start(struct reader *r)
{
	if (!r->has_board || !r->camera_count)
		return complain(r, "a view before the lines \"" BOARD_KEY "\" and \"" CAMERA_KEY
				   "\", which say what it is of");
	int err = observations_init(&r->observations, &r->board, r->cameras, r->camera_count,
				    r->diag);
	if (err)
		return complain(r, "board and cameras, above, cannot be");
	r->started = true;
	r->px = malloc(r->observations.corner_count * sizeof(*r->px));
	return r->px ? 0 : -ENOMEM;
}

/* "ir0-000012.png" of the line's first word. */
static int start_view(struct reader *r, const char *name)
{
	const char *dash = strrchr(name, '-');
	int end = 0;

	if (r->observations.view_count == OBSERVATIONS_VIEWS_MAX)
		return complain(r, "more than %d views", OBSERVATIONS_VIEWS_MAX);
	if (!dash || sscanf(dash, "-%9u.png%n", &r->pose, &end) != 1 || !end || dash[end])
		return complain(r, "%s: expected CAMERA-NUMBER.png", name);
	for (r->camera = 0; r->camera < r->camera_count; r->camera++) {
		const char *camera = r->cameras[r->camera].name;

		if (strlen(camera) == (size_t)(dash - name) &&
		    !strncmp(camera, name, (size_t)(dash - name)))
			break;
	}
	if (r->camera == r->camera_count)
		return complain(r, "%s: no such camera in the heading", name);
	snprintf(r->name, sizeof(r->name), "%s", name);
	return 0;
}

static int end_view(struct reader *r)
{
	r->corner = 0;
	switch (observations_add(&r->observations, r->camera, r->pose, (const double(*)[2])r->px)) {
	case 0:
		return 0;
	case -EEXIST:
		return complain(r, "%s: a second time", r->name);
	case -ERANGE:
		return complain(r, "%s: a corner outside the camera's image", r->name);
	default:
		return -ENOMEM;
	}
}

static int read_corner(struct reader *r)
{
	char name[sizeof(r->name)], x[64], y[64], level[16], *x_end, *y_end;
	int end = 0;

	if (sscanf(r->line, "%95s %63s %63s %15s%n", name, x, y, level, &end) != 4 || r->line[end])
		return complain(r, "expected a file's name, x, y and level");
	int err = r->started ? 0 : start(r);
	if (!err && r->corner == 0)
		err = start_view(r, name);
	if (err)
		return err;
	if (strcmp(name, r->name))
		return complain(r, "%s has %u corners and the board %u", r->name, r->corner,
				r->observations.corner_count);
	double *px = r->px[r->corner];
	px[0] = px[1] = NAN;
	if (strcmp(level, "-")) {
		px[0] = strtod(x, &x_end);
		px[1] = strtod(y, &y_end);
		if (*x_end || *y_end || !isfinite(px[0]) || !isfinite(px[1]))
			return complain(r, "\"%s\", \"%s\": not numbers", x, y);
	}
	return ++r->corner == r->observations.corner_count ? end_view(r) : 0;
}

static int read_lines(struct reader *r)
{
	ssize_t length;
	int err = 0;

	while (!err && (length = getline(&r->line, &r->line_size, r->file)) > 0) {
		r->line_number++;
		if (memchr(r->line, 0, (size_t)length))
			return complain(r, "not text");
		r->line[strcspn(r->line, "\n")] = 0;
		err = r->line[0] == '#' ? read_heading(r) : read_corner(r);
	}
	if (err)
		return err;
	if (ferror(r->file))
		return complain(r, "cannot be read on: %s", strerror(errno));
	if (!r->started)
		return complain(r, "no view in it");
	return r->corner ? complain(r, "%s: the file ends within it", r->name) : 0;
}

int observations_read(struct observations *observations, const char *path, struct diag *diag)
{
	struct reader *r = calloc(1, sizeof(*r));

	if (!r)
		return -ENOMEM;
	r->path = path;
	r->diag = diag;
	r->file = fopen(path, "re");
	int err = r->file ? read_lines(r) : -errno;
	if (!r->file)
		diag_add(diag, "%s: %s", path, strerror(-err));
	else
		fclose(r->file);
	if (err)
		observations_finish(&r->observations);
	else
		*observations = r->observations;
	free(r->line);
	free(r->px);
	free(r);
	return err;
}
