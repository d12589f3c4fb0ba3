/*
 * A score in words and numbers.
 */
#include "ctl/play_report.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>

#include "base/clock.h"
#include "ctl/print_json.h"

/* Of nothing it is 0. */
static double share(double part, uint64_t whole)
{
	return whole ? part / (double)whole : 0;
}

/* Scene time over this thread's CPU time. */
static double speed(const struct play_report *report)
{
	const struct sim_play_cost *cost = report->cost;
	double cpu_s = (cost->truth_us + cost->blobs_us + cost->tracker_us) * 1e-6;

	return cpu_s > 0 ? (double)report->score->shots / report->script->rate_hz / cpu_s : 0;
}

static json_t *cost_json(const struct play_report *report)
{
	const struct sim_play_cost *cost = report->cost;
	uint64_t shots = report->score->shots;

	return json_pack("{s:f, s:f, s:f}", "truth", share(cost->truth_us, shots), "blobs",
			 share(cost->blobs_us, shots), "tracker", share(cost->tracker_us, shots));
}

static json_t *bin_json(const struct score_bin *bin)
{
	return json_pack("{s:I, s:f, s:f, s:f}", "count", (json_int_t)bin->count, "nees_per_axis",
			 share(bin->nees, bin->count) / 3, "ellipsoid_share",
			 share((double)bin->inside, bin->count), "rms_mm",
			 1e3 * sqrt(share(bin->error2_m2, bin->count)));
}

static json_t *bins_json(const struct score *score)
{
	json_t *bins = json_array();

	for (int b = 0; b < SCORE_BINS; b++) {
		json_t *bin = bin_json(&score->bins[b]);

		json_object_set_new(bin, "cameras", json_integer(b + 2));
		json_array_append_new(bins, bin);
	}
	return bins;
}

static json_t *wrong_json(const struct score *s)
{
	return json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:I}", "wrong", (json_int_t)s->wrong,
			 "swapped", (json_int_t)s->swapped, "ghosts", (json_int_t)s->ghosts,
			 "unseen", (json_int_t)s->unseen, "first_wrong_shot",
			 (json_int_t)s->first_wrong_shot, "sure", (json_int_t)s->sure, "sure_wrong",
			 (json_int_t)s->sure_wrong);
}

static json_t *names_json(const struct score *s)
{
	return json_pack("{s:I, s:I, s:I, s:f, s:f, s:I, s:I}", "shots", (json_int_t)s->shots,
			 "seen_by_three", (json_int_t)s->seen3, "right", (json_int_t)s->right,
			 "right_share", share((double)s->right, s->seen3), "unnamed_share",
			 share((double)s->unnamed, s->seen3), "first_named_shot",
			 (json_int_t)s->first_named_shot, "stray", (json_int_t)s->stray);
}

static json_t *places_json(const struct score *s)
{
	return json_pack("{s:f, s:f, s:f, s:o, s:o}", "rms_mm",
			 1e3 * sqrt(share(s->error2_m2, s->measured)), "nees_per_axis",
			 share(s->nees, s->measured) / 3, "head_rms_mm",
			 1e3 * sqrt(share(s->head_error2_m2, s->heads)), "by_cameras", bins_json(s),
			 "predicted", bin_json(&s->predicted));
}

static json_t *play_json(const struct play_report *report)
{
	const struct sim_script *script = report->script;

	return json_pack("{s:s, s:s, s:I, s:s, s:I, s:I, s:f, s:o}", "scene", script->name, "level",
			 report->level, "seed", (json_int_t)report->seed, "optics",
			 script->optics == SIM_OPTICS_TAILED ? "tailed" : "gaussian", "blobs_lost",
			 (json_int_t)report->blobs_lost, "markers_lost",
			 (json_int_t)report->markers_lost, "speed", speed(report),
			 "cpu_us_per_shot", cost_json(report));
}

void play_report_print_json(const struct play_report *report)
{
	json_t *parts[] = {names_json(report->score), wrong_json(report->score),
			   places_json(report->score)};
	json_t *object = play_json(report);

	for (size_t i = 0; i < sizeof(parts) / sizeof(*parts); i++) {
		json_object_update(object, parts[i]);
		json_decref(parts[i]);
	}
	print_json(object);
}

static void print_bin(const struct score_bin *bin)
{
	printf("%" PRIu64 ", %.4f mm, NEES / 3 = %.2f, %.1f %% in their 95 %% ellipsoids\n",
	       bin->count, 1e3 * sqrt(share(bin->error2_m2, bin->count)),
	       share(bin->nees, bin->count) / 3, 100 * share((double)bin->inside, bin->count));
}

static void print_bins(const struct score *s)
{
	for (int b = 0; b < SCORE_BINS; b++)
		if (s->bins[b].count) {
			printf("%-9s by %d%s: ", "cameras", b + 2,
			       b + 1 == SCORE_BINS ? " or more" : "");
			print_bin(&s->bins[b]);
		}
	printf("%-9s ", "predicted");
	print_bin(&s->predicted);
}

void play_report_print_table(const struct play_report *report)
{
	const struct score *s = report->score;

	printf("%s: %s\n", report->script->name, report->script->title);
	printf("%-9s %" PRIu64 " in %.1f s, %.1f x real time on one core\n", "shots", s->shots,
	       (double)report->elapsed_ns / NS_PER_S, speed(report));
	printf("%-9s %.3f %% of %" PRIu64 " seen by three cameras or more\n", "right",
	       100 * share((double)s->right, s->seen3), s->seen3);
	printf("%-9s %.3f %%\n", "unnamed", 100 * share((double)s->unnamed, s->seen3));
	printf("%-9s %" PRIu64 ", of those %" PRIu64 " swapped, %" PRIu64 " on ghosts\n", "wrong",
	       s->wrong, s->swapped, s->ghosts);
	printf("%-9s %" PRIu64 " names with a confidence from %.2f on, %" PRIu64 " of them wrong\n",
	       "sure", s->sure, SCORE_SURE, s->sure_wrong);
	printf("%-9s %" PRIu64 " measured where fewer than two cameras see a marker\n", "unseen",
	       s->unseen);
	printf("%-9s %.4f mm, NEES / 3 = %.2f\n", "rms",
	       1e3 * sqrt(share(s->error2_m2, s->measured)), share(s->nees, s->measured) / 3);
	print_bins(s);
	printf("%-9s %" PRIu64 " blobs, %" PRIu64 " markers\n", "lost", report->blobs_lost,
	       report->markers_lost);
	printf("%-9s truth %.0f, blobs %.0f, tracker %.0f us of CPU time a shot\n", "cost",
	       share(report->cost->truth_us, s->shots), share(report->cost->blobs_us, s->shots),
	       share(report->cost->tracker_us, s->shots));
}
