/*
 * Tables and summaries on plain terminals: no more than clearing the screen is asked of them.
 */
#include "demo/show.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define CALIBRATED_RMS_MAX_MM 0.15
#define CLEAR_SCREEN "\033[H\033[2J"
#define CELL_COLUMNS 41 /* of one label, as show_label() prints it */
#define ROWS_AROUND 9   /* lines of the screen that are not the table's */

static const char *status_word(int status)
{
	static const char *const words[] = {"missing", "predicted", "two cameras", "measured"};

	return status >= 0 && status <= STAGE_MEASURED ? words[status] : "?";
}

/* Largest error first; those without a position come last. */
static int compare_views(const void *a, const void *b)
{
	const struct label_view *left = a, *right = b;

	return (left->error_m < right->error_m) - (left->error_m > right->error_m);
}

static struct winsize terminal_size(FILE *out)
{
	struct winsize size = {.ws_row = 24, .ws_col = 80};

	if (ioctl(fileno(out), TIOCGWINSZ, &size) < 0 || size.ws_row == 0 || size.ws_col == 0)
		return (struct winsize){.ws_row = 24, .ws_col = 80};
	return size;
}

static void show_label(FILE *out, const struct label_view *view)
{
	char error[16] = "-";

	if (view->status != STAGE_MISSING)
		snprintf(error, sizeof(error), "%.3f mm", 1e3 * view->error_m);
	fprintf(out, "%-14.14s%11s %-11s%2u  ", view->name, error, status_word(view->status),
		view->camera_count);
}

static void show_labels(FILE *out, const struct referee *referee)
{
	struct label_view views[LABEL_MAX];
	struct winsize size = terminal_size(out);
	uint32_t columns = size.ws_col > CELL_COLUMNS ? size.ws_col / CELL_COLUMNS : 1;
	uint32_t rows = size.ws_row > ROWS_AROUND ? size.ws_row - ROWS_AROUND : 1;
	uint32_t count = referee->label_count;

	memcpy(views, referee->views, count * sizeof(views[0]));
	qsort(views, count, sizeof(views[0]), compare_views);
	for (uint32_t row = 0; row < rows && row < count; row++) {
		for (uint32_t i = row; i < count && i < columns * rows; i += rows)
			show_label(out, &views[i]);
		fputc('\n', out);
	}
}

void show_table(FILE *out, const struct referee *referee, const struct results *r,
		const struct demo_facts *facts)
{
	fprintf(out, CLEAR_SCREEN "stage demo: %u cameras (%s) at %.4g Hz, scene %s, %.0f s\n",
		facts->camera_count, facts->mode, facts->rate_hz, facts->scene, facts->seconds);
	fprintf(out,
		"shots    %" PRIu64 " of %" PRIu64 ", lost %" PRIu64 ", incomplete %" PRIu64
		", %.1f per second\n",
		r->shots_received, r->shots_expected, r->shots_lost, referee->sets_incomplete,
		r->rate_hz);
	fprintf(out, "error    median %.3f mm, 95 %% below %.3f mm, rms %.3f mm\n",
		r->error_median_mm, r->error_p95_mm, r->error_rms_mm);
	fprintf(out,
		"labels   %.2f %% right, wrong %" PRIu64 ", swapped %" PRIu64
		", unlabelled %" PRIu64 "\n",
		r->right_percent, referee->wrong_count, referee->swapped_count,
		referee->unlabelled_count);
	fprintf(out, "latency  p50 %.2f ms, p99 %.2f ms from last pixel to here\n\n",
		r->latency_p50_ms, r->latency_p99_ms);
	show_labels(out, referee);
	fflush(out);
}

void show_line(FILE *out, const struct referee *referee, const struct results *r,
	       const struct demo_facts *facts)
{
	fprintf(out,
		"%5.1f s: %" PRIu64 " shots, lost %" PRIu64 ", incomplete %" PRIu64
		", error median %.3f mm, labels %.2f %% right, wrong %" PRIu64
		", latency p50 %.2f p99 %.2f ms\n",
		facts->seconds, r->shots_received, r->shots_lost, referee->sets_incomplete,
		r->error_median_mm, r->right_percent, referee->wrong_count, r->latency_p50_ms,
		r->latency_p99_ms);
	fflush(out);
}

/* Under fire and without SCHED_FIFO nobody promises that every picture comes in time; a shot may
 * then be lost, or lack so many cameras that markers stay without a name. */
static bool is_excused(const struct demo_facts *facts)
{
	return facts->stress && !facts->stress->fifo;
}

/* Of a rig that was just made: the rms says more of it than the median. */
static bool is_calibrated(const struct results *r, const struct demo_facts *facts)
{
	return !facts->calibration || r->error_rms_mm <= CALIBRATED_RMS_MAX_MM;
}

bool demo_has_passed(const struct referee *referee, const struct results *r,
		     const struct demo_facts *facts)
{
	return r->accurate && is_calibrated(r, facts) &&
	       ((r->named && r->complete) || is_excused(facts)) && !facts->ended_early &&
	       (!facts->stress || stress_has_passed(facts->stress, referee));
}

static void show_verdict(FILE *out, const struct referee *referee, const struct results *r,
			 const struct demo_facts *facts)
{
	if (facts->stress)
		stress_show(out, facts->stress, referee);
	if (demo_has_passed(referee, r, facts)) {
		fprintf(out, "passed\n");
		return;
	}
	fprintf(out, "FAILED:%s%s%s%s%s%s\n", r->accurate ? "" : " median error above 0.1 mm;",
		is_calibrated(r, facts) ? "" : " rms above 0.15 mm, rigidly aligned;",
		r->named || is_excused(facts) ? "" : " fewer than 98 % right labels;",
		r->complete || is_excused(facts) ? "" : " more than 1 % of the shots lost;",
		!facts->stress || stress_has_passed(facts->stress, referee) ? ""
									    : " see NOT above;",
		facts->ended_early ? " the stream ended early;" : "");
}

static void show_station(FILE *out, const struct demo_facts *facts)
{
	const struct station_report *station = &facts->station;

	if (!station->known)
		return;
	for (uint32_t i = 0; i < station->hd_count; i++) {
		const struct hd_report *hd = &station->hd[i];
		char phase[16] = "unknown";

		if (hd->phase_known)
			snprintf(phase, sizeof(phase), "%u", hd->phase);
		fprintf(out,
			"%-10s %" PRIu64 " frames, %" PRIu64 " lost, phase %s, %" PRIu64
			" off phase\n",
			hd->name, hd->frames, hd->lost, phase, hd->off_phase);
	}
	if (facts->hd_camera_count)
		fprintf(out, "HD shots   %" PRIu64 " of the marker sets name an HD frame\n",
			facts->hd_shots);
	if (!facts->cameras_counted)
		fprintf(out, "simulator  %" PRIu64 " frames handed over late\n", station->sim_late);
}

static void show_calibration(FILE *out, const struct demo_facts *facts, const struct results *r)
{
	const struct calibration_report *made = facts->calibration;

	if (made)
		fprintf(out,
			"rig        made in %.0f s of %u poses of a board, rms %.3f px; with it "
			"the "
			"markers are %.4f mm rms from the truth, rigidly aligned\n",
			made->seconds, made->poses, made->rms_px, r->error_rms_mm);
}

void show_summary(FILE *out, const struct referee *referee, const struct results *r,
		  const struct demo_facts *facts)
{
	char hd[40] = "";

	if (facts->hd_camera_count)
		snprintf(hd, sizeof(hd), " and %u HD cameras", facts->hd_camera_count);
	fprintf(out,
		"%u cameras (%s) at %.4g Hz%s, scene %s, seed %" PRIu64 ": judged for %.1f s, "
		"first right label after %.1f s\n",
		facts->camera_count, facts->mode, facts->rate_hz, hd, facts->scene, facts->seed,
		facts->seconds, facts->startup_s);
	fprintf(out,
		"shots      %" PRIu64 " expected, %" PRIu64 " received (%.1f per second), %" PRIu64
		" lost (%.2f %%), %" PRIu64 " incomplete (%.2f %%), %" PRIu64 " repeated\n",
		r->shots_expected, r->shots_received, r->rate_hz, r->shots_lost, r->lost_percent,
		referee->sets_incomplete, r->incomplete_percent, referee->sets_repeated);
	fprintf(out,
		"error      median %.4f mm, 95 %% below %.4f mm, rms %.4f mm (%" PRIu64
		" markers seen by 3 cameras)\n",
		r->error_median_mm, r->error_p95_mm, r->error_rms_mm, referee->error_m.count);
	fprintf(out,
		"labels     %.3f %% right of %" PRIu64 " that 3 cameras see (within 3 mm of their "
		"truth), %" PRIu64 " unlabelled, %" PRIu64 " wrong, %" PRIu64 " of them swapped\n",
		r->right_percent, referee->seen_count, referee->unlabelled_count,
		referee->wrong_count, referee->swapped_count);
	fprintf(out,
		"latency    p50 %.2f ms, p99 %.2f ms from last pixel in memory to subscriber\n",
		r->latency_p50_ms, r->latency_p99_ms);
	fprintf(out,
		"timestamps off by p50 %.1f us, at most %.1f us, %" PRIu64
		" beyond the bound that the station gives\n",
		r->timestamp_p50_us, r->timestamp_max_us, referee->beyond_bound_count);
	if (facts->cameras_counted)
		fprintf(out,
			"simulator  %" PRIu64 " frames sent, %" PRIu64
			" of them over 1 ms late, %" PRIu64 " never sent\n",
			facts->cameras.frames_sent, facts->cameras.frames_late,
			facts->cameras.frames_skipped);
	show_calibration(out, facts, r);
	show_station(out, facts);
	show_verdict(out, referee, r, facts);
}

/* JSON has no NaN: what was not measured is null. */
static json_t *number(double value)
{
	return isfinite(value) ? json_real(value) : json_null();
}

static json_t *json_shots(const struct referee *referee, const struct results *r)
{
	return json_pack("{sI sI sI so sI so sI sI so}", "expected", (json_int_t)r->shots_expected,
			 "received", (json_int_t)r->shots_received, "lost",
			 (json_int_t)r->shots_lost, "lost_percent", number(r->lost_percent),
			 "incomplete", (json_int_t)referee->sets_incomplete, "incomplete_percent",
			 number(r->incomplete_percent), "repeated",
			 (json_int_t)referee->sets_repeated, "lost_by_subscriber",
			 (json_int_t)referee->sets_lost, "per_second", number(r->rate_hz));
}

static json_t *json_labels(const struct referee *referee, const struct results *r)
{
	return json_pack(
		"{sI sI so sI sI sI}", "seen", (json_int_t)referee->seen_count, "right",
		(json_int_t)referee->right_count, "right_percent", number(r->right_percent),
		"unlabelled", (json_int_t)referee->unlabelled_count, "wrong",
		(json_int_t)referee->wrong_count, "swapped", (json_int_t)referee->swapped_count);
}

/* Cameras in the station know nothing but how often they were late. */
static json_t *json_simulator(const struct demo_facts *facts)
{
	const struct camera_counts *counts = &facts->cameras;

	if (!facts->cameras_counted)
		return facts->station.known ? json_pack("{sI}", "frames_late",
							(json_int_t)facts->station.sim_late)
					    : json_null();
	return json_pack("{sI sI sI}", "frames_sent", (json_int_t)counts->frames_sent,
			 "frames_late", (json_int_t)counts->frames_late, "frames_skipped",
			 (json_int_t)counts->frames_skipped);
}

static json_t *json_hd(const struct demo_facts *facts)
{
	json_t *cameras = json_array();

	for (uint32_t i = 0; i < facts->station.hd_count; i++) {
		const struct hd_report *hd = &facts->station.hd[i];

		json_array_append_new(
			cameras,
			json_pack("{ss sI sI so sI}", "name", hd->name, "frames",
				  (json_int_t)hd->frames, "lost", (json_int_t)hd->lost, "phase",
				  hd->phase_known ? json_integer(hd->phase) : json_null(),
				  "off_phase", (json_int_t)hd->off_phase));
	}
	return json_pack("{sI so}", "shots", (json_int_t)facts->hd_shots, "cameras", cameras);
}

static json_t *json_calibration(const struct demo_facts *facts, const struct results *r)
{
	const struct calibration_report *made = facts->calibration;

	return made ? json_pack("{so sI so so so}", "seconds", number(made->seconds), "poses",
				(json_int_t)made->poses, "rms_px", number(made->rms_px), "worst_mm",
				number(made->worst_mm), "aligned_rms_mm", number(r->error_rms_mm))
		    : json_null();
}

void show_json(FILE *out, const struct referee *referee, const struct results *r,
	       const struct demo_facts *facts)
{
	json_t *root = json_pack(
		"{ss ss sI sI so so so so so s{so so so} so s{so so} s{so so sI} so so so so sb}",
		"mode", facts->mode, "scene", facts->scene, "seed", (json_int_t)facts->seed,
		"cameras", (json_int_t)facts->camera_count, "rate_hz", number(facts->rate_hz),
		"seconds", number(facts->seconds), "startup_s", number(facts->startup_s),
		"ended_early", json_boolean(facts->ended_early), "shots", json_shots(referee, r),
		"error_mm", "median", number(r->error_median_mm), "p95", number(r->error_p95_mm),
		"rms", number(r->error_rms_mm), "labels", json_labels(referee, r), "latency_ms",
		"p50", number(r->latency_p50_ms), "p99", number(r->latency_p99_ms),
		"timestamp_error_us", "p50", number(r->timestamp_p50_us), "max",
		number(r->timestamp_max_us), "beyond_bound",
		(json_int_t)referee->beyond_bound_count, "simulator", json_simulator(facts), "hd",
		json_hd(facts), "stress",
		facts->stress ? stress_json(facts->stress, referee) : json_null(), "calibration",
		json_calibration(facts, r), "passed", demo_has_passed(referee, r, facts));

	json_dumpf(root, out, JSON_INDENT(2) | JSON_REAL_PRECISION(6));
	fputc('\n', out);
	json_decref(root);
}
