/*
 * The screen is drawn anew each time: header, bar, three lines per camera, or one where the
 * terminal is too low.
 */
#include "ctl/calibrate/calibrate_guide.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "ctl/calibrate/calibrate_screen.h"
#include "ctl/print_json.h"

#define BAR_WIDTH 40
#define LINE_EVERY_S 2.0
#define HEADER_LINES 5

void guide_begin(struct guide *guide, bool json)
{
	*guide = (struct guide){.json = json, .in_place = !json && isatty(STDERR_FILENO)};
	if (guide->in_place)
		fputs("\033[2J", stderr);
}

static bool is_alone(const struct guide_facts *facts)
{
	return facts->observations->camera_count == 1;
}

double guide_progress(const struct guide_facts *facts)
{
	double sum = 0;
	bool enough = facts->poses >= facts->poses_min;
	uint32_t count = facts->observations->camera_count;

	for (uint32_t c = 0; c < count; c++) {
		sum += coverage_progress(&facts->coverage[c], is_alone(facts));
		enough &= coverage_enough(&facts->coverage[c], is_alone(facts));
	}
	double progress = fmin(sum / count, facts->poses / (double)facts->poses_min);

	return enough ? 1 : fmin(progress, 0.99);
}

/* The camera that is furthest from enough, or UINT32_MAX. */
static uint32_t neediest(const struct guide_facts *facts)
{
	uint32_t worst = UINT32_MAX;
	double least = 1;

	for (uint32_t c = 0; c < facts->observations->camera_count; c++) {
		double progress = coverage_progress(&facts->coverage[c], is_alone(facts));

		if (!coverage_enough(&facts->coverage[c], is_alone(facts)) && progress < least) {
			least = progress;
			worst = c;
		}
	}
	return worst;
}

/* "ir4: upper left, tilted up". */
static void print_next(FILE *out, const struct guide_facts *facts)
{
	uint32_t camera = neediest(facts);
	char words[COVERAGE_WORDS_BYTES];

	if (camera == UINT32_MAX) {
		fputs(facts->poses < facts->poses_min ? "go on, anywhere" : "enough", out);
		return;
	}
	if (!facts->coverage[camera].views) {
		fprintf(out, "%s: it has not seen the board yet",
			facts->observations->cameras[camera].name);
		return;
	}
	coverage_missing(&facts->coverage[camera], is_alone(facts), words);
	fprintf(out, "%s: %s", facts->observations->cameras[camera].name, words);
}

static void print_bar(FILE *out, double progress)
{
	int filled = (int)(progress * BAR_WIDTH);

	fputc('[', out);
	for (int i = 0; i < BAR_WIDTH; i++)
		fputc(i < filled ? '#' : '.', out);
	fprintf(out, "] %.0f %%", 100 * progress);
}

static void print_whole_camera(const struct guide_facts *facts, uint32_t c, int columns)
{
	const struct camera_coverage *k = &facts->coverage[c];
	const struct picture_counts *n = &facts->counts[c];
	char text[3][320];

	screen_camera_facts(text[0], sizeof(text[0]), k, n);
	snprintf(text[1], sizeof(text[1]),
		 "linked to %u cameras; %u searched, %u unchanged, %u skipped", k->linked,
		 n->pictures, n->unchanged, n->skipped);
	screen_camera_missing(text[2], sizeof(text[2]), k, is_alone(facts));
	for (int line = 0; line < COVERAGE_ROWS / 2; line++) {
		fprintf(stderr, "%-8.8s", line ? "" : facts->observations->cameras[c].name);
		screen_camera_line(stderr, k, line);
		fprintf(stderr, "%.*s\033[K\n", columns > 24 ? columns - 24 : 0, text[line]);
	}
}

static void print_short_camera(const struct guide_facts *facts, uint32_t c, int columns)
{
	const struct camera_coverage *k = &facts->coverage[c];
	char text[320];

	screen_camera_missing(text, sizeof(text), k, is_alone(facts));
	fprintf(stderr, "%-8.8s %4u views, %3.0f %%  %.*s\033[K\n",
		facts->observations->cameras[c].name, k->views, 100 * k->part,
		columns > 30 ? columns - 30 : 0, text);
}

static void draw(const struct guide_facts *facts)
{
	struct winsize size = {.ws_row = 24, .ws_col = 80};
	uint32_t count = facts->observations->camera_count;

	ioctl(STDERR_FILENO, TIOCGWINSZ, &size);
	bool whole = size.ws_row > count * (COVERAGE_ROWS / 2) + HEADER_LINES;
	fprintf(stderr,
		"\033[HWave the board before all cameras: %u poses, %u at least; %.0f s\033[K\n",
		facts->poses, facts->poses_min, facts->seconds);
	print_bar(stderr, guide_progress(facts));
	fputs("\033[K\nNow ", stderr);
	print_next(stderr, facts);
	fprintf(stderr, "\033[K\n%sCtrl-C: stop, and keep what there is\033[K\n",
		isatty(STDIN_FILENO) ? "Enter: that is enough, solve. " : "");
	for (uint32_t c = 0; c < count; c++) {
		if (whole)
			print_whole_camera(facts, c, size.ws_col);
		else
			print_short_camera(facts, c, size.ws_col);
	}
	fputs("\033[J", stderr);
}

static void print_line(const struct guide_facts *facts)
{
	fprintf(stderr, "%.0f s: %.0f %%, %u poses; ", facts->seconds, 100 * guide_progress(facts),
		facts->poses);
	print_next(stderr, facts);
	fputc('\n', stderr);
}

static void print_event(const struct guide_facts *facts)
{
	char *next = NULL;
	size_t size = 0;
	FILE *memory = open_memstream(&next, &size);

	if (!memory)
		return;
	print_next(memory, facts);
	fclose(memory);
	print_json(json_pack(
		"{s:s, s:f, s:f, s:i, s:i, s:I, s:I, s:i, s:s, s:o}", "event", "progress",
		"seconds", facts->seconds, "progress", guide_progress(facts), "poses",
		(int)facts->poses, "poses_min", (int)facts->poses_min, "shots",
		(json_int_t)facts->shots, "skipped", (json_int_t)facts->skipped, "near_duplicates",
		(int)facts->near_count, "next", next, "cameras",
		screen_coverage_json(facts->observations, facts->coverage, facts->counts)));
	fflush(stdout);
	free(next);
}

void guide_show(struct guide *guide, const struct guide_facts *facts)
{
	if (guide->in_place) {
		draw(facts);
		return;
	}
	if (facts->seconds < guide->next_line_s && guide_progress(facts) < 1)
		return;
	guide->next_line_s = facts->seconds + LINE_EVERY_S;
	if (guide->json)
		print_event(facts);
	else
		print_line(facts);
}
