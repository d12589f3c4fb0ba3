/*
 * The page: verdict first, then cameras, images, space, and what has changed.
 */
#include "calib/report/report.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "calib/report/report_parts.h"

static const char HEAD[] =
	"<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
	"<title>Calibration report</title>\n<style>\n"
	"body{font:15px/1.5 system-ui,sans-serif;color:#1c2733;background:#f6f7f9;margin:0}\n"
	"main{max-width:1240px;margin:0 auto;padding:24px}\n"
	"h1{font-size:26px;margin:0 0 4px}h2{font-size:19px;margin:34px 0 6px}\n"
	"p{margin:4px 0 12px;color:#4a5866;max-width:75em}\n"
	"table{border-collapse:collapse;background:#fff;border:1px solid #d8dee5}\n"
	"th,td{padding:5px 14px;text-align:right;border-bottom:1px solid #e8ecf0;"
	"font-variant-numeric:tabular-nums}\n"
	"th{background:#eef1f5;font-weight:600}th:first-child,td:first-child{text-align:left}\n"
	".chip{display:inline-block;padding:2px "
	"12px;border-radius:12px;color:#fff;font-weight:600}\n"
	".good{background:#2e8b57}.bad{background:#c0392b}\n"
	"td.over,p.over{color:#c0392b}td.over{font-weight:700}\n"
	"figure{margin:0;background:#fff;border:1px solid #d8dee5;padding:8px}\n"
	"figcaption{margin-bottom:6px}.grid,.row{display:flex;flex-wrap:wrap;gap:12px}\n"
	"svg{background:#fff}svg text{font:11px system-ui,sans-serif;fill:#4a5866}\n"
	".frame{fill:#fff;stroke:#c4ccd5}\n"
	".dots{stroke:#3a86a8;stroke-width:2;stroke-linecap:round;stroke-opacity:.45}\n"
	".boards{stroke:#9aa7b4;stroke-width:3;stroke-linecap:round}\n"
	".arrows path{stroke:#c0392b;stroke-width:1.2}.arrows circle{fill:#1c2733}\n"
	".ruler{stroke:#1c2733;stroke-width:2}\n"
	".camera{stroke:#3a86a8;stroke-width:1.3;fill:none}.tip{fill:#1c2733}\n"
	".worst{fill:none;stroke:#1c2733;stroke-width:1.5}\n"
	".bar{fill:#3a86a8}.limit{stroke:#c0392b;stroke-dasharray:4 3}\n"
	"</style>\n</head>\n<body><main>\n";

static void print_verdict(FILE *file, const struct report_facts *facts)
{
	const struct verdict *verdict = facts->rig->verdict;

	fprintf(file, "<table>\n<tr><th>figure</th><th>value</th><th>limit</th><th></th></tr>\n");
	for (int i = 0; i < VERDICT_LINES; i++) {
		const struct verdict_line *line = &verdict->lines[i];
		bool good = verdict_line_passed(line);

		fprintf(file,
			"<tr><td>%s%s%s</td><td%s>%.3f %s</td><td>%g %s</td>"
			"<td>%s</td></tr>\n",
			line->name, *line->of ? ", " : "", line->of, good ? "" : " class=\"over\"",
			line->value, line->unit, line->limit, line->unit, good ? "good" : "failed");
	}
	fprintf(file, "</table>\n");
}

static void print_beginning(FILE *file, const struct report_facts *facts)
{
	const struct rig_facts *rig = facts->rig;
	const struct board *board = &rig->observations->board;
	char hash[OBSERVATIONS_HASH_BYTES];

	observations_hash(rig->observations, hash);
	fprintf(file, "<h1>Calibration <span class=\"chip %s\">%s</span></h1>\n",
		rig->verdict->passed ? "good" : "bad", rig->verdict->passed ? "passed" : "failed");
	fprintf(file,
		"<p>Revision %s by %s, from %u poses of a board of %d x %d squares of %.2f mm: %u "
		"views, %u corners, %u of them refused. Observations %s. Lens %s.</p>\n",
		facts->revision, rig->software, rig->solution->pose_count, board->squares_x,
		board->squares_y, 1e3 * board->square_m, rig->solution->view_count,
		rig->solution->used_count, rig->solution->outlier_count, hash, rig->solution->lens);
	print_verdict(file, facts);
	if (facts->scale_refused)
		fprintf(file,
			"<p class=\"over\"><b>Not in force:</b> all distances between cameras "
			"are %.4f times those of the rig before. Measure the print's rulers; when "
			"this print is the right one, say --accept-scale.</p>\n",
			facts->scale);
	fprintf(file, "<p><b>To make it better,</b> wave next at the worst place: %s.</p>\n",
		facts->wave_next);
	fprintf(file,
		"<p>Rigs from half of the poses each differ by %.3f mm over the volume. The board "
		"is "
		"bent by %.2f mm across and %.2f mm down. Pixel noise: %.3f px.</p>\n",
		1e3 * rig->cross_check->halves_differ_m, 1e3 * rig->solution->warp_m[0],
		1e3 * rig->solution->warp_m[1], rig->solution->sigma_px);
}

static void print_move(FILE *file, const struct camera_move *move)
{
	if (move->known)
		fprintf(file, "<td>%.2f mm</td><td>%.2f mrad</td></tr>\n", move->moved_mm,
			move->turned_mrad);
	else
		fprintf(file, "<td>new</td><td></td></tr>\n");
}

static void print_cameras(FILE *file, const struct report_facts *facts)
{
	const struct observations *o = facts->rig->observations;
	const struct solution *s = facts->rig->solution;

	fprintf(file, "<h2>Cameras and views</h2>\n<table>\n<tr><th>camera</th><th>image</th>"
		      "<th>views</th><th>linked to</th><th>covered</th><th>tilted up to</th>"
		      "<th>focal length</th><th>rms</th>");
	if (*facts->before)
		fprintf(file, "<th>moved since %s</th><th>turned</th>", facts->before);
	fprintf(file, "</tr>\n");
	for (uint32_t c = 0; c < o->camera_count; c++) {
		const struct camera_coverage *k = &facts->coverage[c];
		bool over = s->rms_camera_px[c] > facts->rig->verdict->lines[0].limit;

		fprintf(file,
			"<tr><td>%s</td><td>%d x %d</td><td>%u</td><td>%u</td><td>%.0f %%</td>"
			"<td>%.0f°</td><td>%.1f px</td><td%s>%.3f px</td>",
			o->cameras[c].name, o->cameras[c].width_px, o->cameras[c].height_px,
			k->views, k->linked, 100 * k->part, k->tilt_deg,
			s->intrinsics[(size_t)c * s->lens_count], over ? " class=\"over\"" : "",
			s->rms_camera_px[c]);
		if (*facts->before)
			print_move(file, &facts->moves[c]);
		else
			fprintf(file, "</tr>\n");
	}
	fprintf(file, "</table>\n");
	if (*facts->before)
		fprintf(file,
			"<p>Compared with the rig from before by the centres of all cameras. A "
			"camera "
			"that stands out was moved; distances are %.5f times those of "
			"before.</p>\n",
			facts->scale);
}

#define BAR_HEIGHT 22
#define BAR_LEFT 90
#define BAR_WIDTH 520.0

static void print_bars(FILE *file, const struct report_facts *facts)
{
	const struct observations *o = facts->rig->observations;
	const struct solution *s = facts->rig->solution;
	double limit = facts->rig->verdict->lines[0].limit, most = limit;
	int height = BAR_HEIGHT * (int)o->camera_count + 24;

	for (uint32_t c = 0; c < o->camera_count; c++)
		most = fmax(most, s->rms_camera_px[c]);
	fprintf(file,
		"<h2>Rms per camera</h2>\n<svg viewBox=\"0 0 700 %d\" width=\"700\" "
		"height=\"%d\">\n<rect width=\"700\" height=\"%d\" class=\"frame\"/>\n",
		height, height, height);
	for (uint32_t c = 0; c < o->camera_count; c++) {
		int y = BAR_HEIGHT * (int)c + 4;
		double length = BAR_WIDTH * s->rms_camera_px[c] / most;

		fprintf(file,
			"<text x=\"10\" y=\"%d\">%s</text><rect class=\"bar\" x=\"%d\" y=\"%d\" "
			"width=\"%.1f\" height=\"14\"/><text x=\"%.1f\" y=\"%d\">%.3f px</text>\n",
			y + 12, o->cameras[c].name, BAR_LEFT, y, length, BAR_LEFT + length + 6,
			y + 12, s->rms_camera_px[c]);
	}
	fprintf(file,
		"<path class=\"limit\" d=\"M%.1f 0v%d\"/><text x=\"%.1f\" y=\"%d\" "
		"text-anchor=\"end\">limit %g px</text>\n</svg>\n",
		BAR_LEFT + BAR_WIDTH * limit / most, height - 16,
		BAR_LEFT + BAR_WIDTH * limit / most, height - 5, limit);
}

int report_write(const char *path, const struct report_facts *facts, struct diag *diag)
{
	FILE *file = fopen(path, "wxe");
	int err = file ? 0 : -errno;

	if (!err) {
		fputs(HEAD, file);
		print_beginning(file, facts);
		print_cameras(file, facts);
		print_bars(file, facts);
		report_space_print(file, facts);
		report_images_print(file, facts);
		fputs("</main></body>\n</html>\n", file);
		err = ferror(file) ? -EIO : 0;
		if (fclose(file) && !err)
			err = -errno;
	}
	if (err)
		diag_add(diag, "%s: cannot write: %s", path, strerror(-err));
	return err;
}
