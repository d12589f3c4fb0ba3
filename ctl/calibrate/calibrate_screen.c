/*
 * Bars and small pictures of half blocks.
 */
#include "ctl/calibrate/calibrate_screen.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define BAR_WIDTH 30
#define LINES (COVERAGE_ROWS / 2) /* of a camera's picture */

void screen_progress(const struct picture_progress *progress, void *user)
{
	uint32_t done = progress->done, of = progress->of ? progress->of : 1;
	uint32_t filled = done * BAR_WIDTH / of;

	(void)user;
	fprintf(stderr, "\r[");
	for (uint32_t i = 0; i < BAR_WIDTH; i++)
		fputc(i < filled ? '#' : '.', stderr);
	fprintf(stderr, "] %u of %u pictures, the board in %u%s", done, progress->of,
		(uint32_t)progress->with_board, done >= progress->of ? "\n" : " ");
}

void screen_camera_line(FILE *out, const struct camera_coverage *camera, int line)
{
	static const char *const blocks[] = {" ", "▀", "▄", "█"};

	fputs("▕", out);
	for (int x = 0; x < COVERAGE_COLUMNS; x++)
		fputs(blocks[(camera->cells[2 * line][x] > 0) +
			     2 * (camera->cells[2 * line + 1][x] > 0)],
		      out);
	fputs("▏ ", out);
}

static void add(char *text, size_t size, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

static void add(char *text, size_t size, const char *format, ...)
{
	size_t length = strlen(text);
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text + length, size - length, format, arguments);
	va_end(arguments);
}

void screen_camera_facts(char *text, size_t size, const struct camera_coverage *camera,
			 const struct picture_counts *counts)
{
	snprintf(text, size, "%u views, %.0f %% of the image", camera->views, 100 * camera->part);
	if (!isnan(camera->tilt_deg))
		add(text, size, ", tilted up to %.0f°", camera->tilt_deg);
	if (counts && !isnan(counts->blur_px))
		add(text, size, ", blur %.1f px", counts->blur_px);
	if (counts && counts->blurred)
		add(text, size, ", %u blurred", counts->blurred);
	if (counts && counts->damaged)
		add(text, size, ", %u damaged", counts->damaged);
}

void screen_camera_missing(char *text, size_t size, const struct camera_coverage *camera,
			   bool alone)
{
	char words[COVERAGE_WORDS_BYTES];
	bool enough = coverage_enough(camera, alone);

	coverage_missing(camera, alone, words);
	snprintf(text, size, "%s%s%s", enough ? "enough" : "",
		 *words ? enough ? "; better still with: " : "missing: " : "", words);
}

static void print_links(const struct observations *o, const struct camera_coverage *camera)
{
	const char *between = "together with ";

	for (uint32_t c = 0; c < o->camera_count; c++)
		if (camera->links[c]) {
			printf("%s%s %u", between, o->cameras[c].name, camera->links[c]);
			between = ", ";
		}
	puts(camera->linked ? "" : "no link to another camera");
}

void screen_coverage(const struct observations *o, const struct camera_coverage *coverage,
		     const struct picture_counts *counts)
{
	char text[320];

	for (uint32_t c = 0; c < o->camera_count; c++)
		for (int line = 0; line < LINES; line++) {
			printf("%-8s", line ? "" : o->cameras[c].name);
			screen_camera_line(stdout, &coverage[c], line);
			if (line == 1) {
				print_links(o, &coverage[c]);
				continue;
			}
			if (line == 0)
				screen_camera_facts(text, sizeof(text), &coverage[c],
						    counts ? &counts[c] : NULL);
			else
				screen_camera_missing(text, sizeof(text), &coverage[c],
						      o->camera_count == 1);
			puts(text);
		}
}

void screen_verdict(const struct verdict *verdict)
{
	for (int i = 0; i < VERDICT_LINES; i++) {
		const struct verdict_line *line = &verdict->lines[i];

		printf("%s  %-31s %8.3f %s, limit %g%s%s\n",
		       verdict_line_passed(line) ? "good  " : "FAILED", line->name, line->value,
		       line->unit, line->limit, *line->of ? ": " : "", line->of);
	}
}

json_t *screen_coverage_json(const struct observations *o, const struct camera_coverage *coverage,
			     const struct picture_counts *counts)
{
	json_t *cameras = json_array();
	char words[COVERAGE_WORDS_BYTES];

	for (uint32_t c = 0; c < o->camera_count; c++) {
		const struct camera_coverage *k = &coverage[c];
		json_t *object;

		coverage_missing(k, o->camera_count == 1, words);
		object = json_pack("{s:s, s:i, s:f, s:i, s:b, s:s}", "name", o->cameras[c].name,
				   "views", (int)k->views, "image_part", k->part, "linked",
				   (int)k->linked, "enough",
				   coverage_enough(k, o->camera_count == 1), "missing", words);
		if (!isnan(k->tilt_deg))
			json_object_set_new(object, "tilt_deg", json_real(k->tilt_deg));
		if (counts) {
			json_object_set_new(object, "pictures", json_integer(counts[c].pictures));
			json_object_set_new(object, "unchanged", json_integer(counts[c].unchanged));
			json_object_set_new(object, "skipped", json_integer(counts[c].skipped));
			json_object_set_new(object, "blurred", json_integer(counts[c].blurred));
			json_object_set_new(object, "damaged", json_integer(counts[c].damaged));
		}
		if (counts && !isnan(counts[c].blur_px))
			json_object_set_new(object, "blur_px", json_real(counts[c].blur_px));
		json_array_append_new(cameras, object);
	}
	return cameras;
}

json_t *screen_verdict_json(const struct verdict *verdict)
{
	json_t *lines = json_array();

	for (int i = 0; i < VERDICT_LINES; i++) {
		const struct verdict_line *line = &verdict->lines[i];

		json_array_append_new(lines,
				      json_pack("{s:s, s:s, s:f, s:f, s:b}", "name", line->name,
						"unit", line->unit, "value", line->value, "limit",
						line->limit, "passed", verdict_line_passed(line)));
	}
	return lines;
}
