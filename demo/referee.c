/*
 * The comparison with the truth, and the figures that come of it.
 */
#include "demo/referee.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

#define HISTOGRAM_BINS (sizeof(((struct histogram *)0)->bins) / sizeof(uint64_t))

/* What a demonstration must reach. */
#define ERROR_MEDIAN_MAX_MM 0.1
#define RIGHT_MIN_PERCENT 98.0
#define LOST_MAX_PERCENT 1.0

static void histogram_add(struct histogram *h, double value)
{
	double bin = value / h->bin_width;

	h->bins[bin < (double)HISTOGRAM_BINS ? (size_t)bin : HISTOGRAM_BINS - 1]++;
	h->count++;
	h->max = value > h->max ? value : h->max;
}

/* The middle of the bin that the given part of all values lie below; NaN when there are none. */
static double histogram_quantile(const struct histogram *h, double part)
{
	uint64_t below = 0;
	size_t bin = 0;

	if (h->count == 0)
		return NAN;
	while (bin < HISTOGRAM_BINS - 1 &&
	       (double)(below += h->bins[bin]) <= part * (double)h->count)
		bin++;
	return fmin(((double)bin + 0.5) * h->bin_width, h->max);
}

void referee_init(struct referee *referee, const struct sim_scene *scene, int64_t epoch_ns)
{
	memset(referee, 0, sizeof(*referee));
	referee->scene = scene;
	referee->epoch_ns = epoch_ns;
	referee->rt_scene_station = POSE_IDENTITY;
	referee->error_m.bin_width = REFEREE_NEAR_M / 8000;
	referee->latency_s.bin_width = 20e-6;
	referee->timestamp_error_s.bin_width = 0.5e-6;
}

static int find_truth(const struct sim_scene *scene, const char *name, uint32_t *out)
{
	const struct layout *layout = sim_scene_layout(scene);

	for (uint32_t i = 0; i < layout->marker_count; i++)
		if (strcmp(layout->markers[i].name, name) == 0) {
			*out = i;
			return 0;
		}
	return -EINVAL;
}

int referee_describe(struct referee *referee, const struct stage_description *description)
{
	const struct layout *layout = sim_scene_layout(referee->scene);

	if (description->label_count != layout->marker_count)
		return -EINVAL;
	for (uint32_t i = 0; i < description->label_count; i++) {
		int r = find_truth(referee->scene, description->labels[i].name,
				   &referee->truth_of_label[i]);
		if (r < 0)
			return r;
		referee->views[i] = (struct label_view){
			.name = layout->markers[referee->truth_of_label[i]].name};
	}
	referee->label_count = description->label_count;
	return 0;
}

/* The scene's exposure nearest to a time of the station's clock. */
static int64_t nearest_exposure(const struct referee *referee, int64_t time_ns)
{
	double period_ns = (double)sim_scene_period_ns(referee->scene);
	int64_t first_ns = referee->epoch_ns + sim_scene_mid_exposure_ns(referee->scene, 0);
	int64_t exposure = llround((double)(time_ns - first_ns) / period_ns);

	return exposure > 0 ? exposure : 0;
}

void referee_find_truth(struct referee *referee, int64_t mid_exposure_ns)
{
	uint64_t exposure = (uint64_t)nearest_exposure(referee, mid_exposure_ns);

	sim_scene_truth(referee->scene,
			(double)sim_scene_mid_exposure_ns(referee->scene, exposure) / 1e9,
			&referee->truth);
}

static bool is_near_another(const struct referee *referee, struct vec3 p_m, uint32_t own)
{
	for (uint32_t i = 0; i < referee->truth.marker_count; i++)
		if (i != own &&
		    vec3_distance(p_m, referee->truth.markers[i].p_stage_m) <= REFEREE_NEAR_M)
			return true;
	return false;
}

static void judge_right(struct referee *referee, const struct stage_marker *marker, double error_m,
			int64_t received_ns)
{
	referee->right_count++;
	if (!referee->first_label_ns)
		referee->first_label_ns = received_ns;
	if (marker->status != STAGE_MEASURED)
		return;
	referee->error_sum_m2 += error_m * error_m;
	histogram_add(&referee->error_m, error_m);
}

/* `marker` is NULL when the set does not have the label. */
static void judge_label(struct referee *referee, uint32_t label, const struct stage_marker *marker,
			int64_t received_ns)
{
	const uint32_t own = referee->truth_of_label[label];
	const struct sim_truth_marker *truth = &referee->truth.markers[own];
	struct label_view *view = &referee->views[label];
	bool is_seen = __builtin_popcount(truth->visible_mask) >= 3;

	view->status = marker ? marker->status : STAGE_MISSING;
	view->camera_count = marker ? marker->camera_count : 0;
	view->error_m = 0;
	referee->seen_count += is_seen;
	if (view->status == STAGE_MISSING) {
		referee->unlabelled_count += is_seen;
		return;
	}
	struct vec3 p_m = pose_apply(&referee->rt_scene_station,
				     (struct vec3){marker->p_m[0], marker->p_m[1], marker->p_m[2]});
	view->error_m = vec3_distance(p_m, truth->p_stage_m);
	if (view->status == STAGE_PREDICTED) {
		referee->unlabelled_count += is_seen;
	} else if (!(view->error_m <= REFEREE_NEAR_M)) {
		referee->wrong_count++;
		referee->swapped_count += is_near_another(referee, p_m, own);
	} else if (is_seen) {
		judge_right(referee, marker, view->error_m, received_ns);
	}
}

/* A name given twice is wrong the second time. */
static void judge_labels(struct referee *referee, const struct stage_marker_set *set,
			 int64_t received_ns)
{
	const struct stage_marker *by_label[LABEL_MAX] = {0};

	for (uint32_t i = 0; i < set->marker_count; i++) {
		const struct stage_marker *marker = &set->markers[i];

		if (marker->label < 0 || (uint32_t)marker->label >= referee->label_count)
			continue;
		referee->wrong_count += by_label[marker->label] != NULL;
		by_label[marker->label] = marker;
	}
	for (uint32_t label = 0; label < referee->label_count; label++)
		judge_label(referee, label, by_label[label], received_ns);
}

/* Returns the exposure that the set shows, or -1 for one that a set has shown before. */
static int64_t note_exposure(struct referee *referee, const struct stage_marker_set *set)
{
	int64_t exposure = nearest_exposure(referee, set->mid_exposure_ns);

	if (referee->started && exposure <= referee->last_exposure) {
		referee->sets_repeated++;
		return -1;
	}
	if (!referee->started)
		referee->first_exposure = exposure;
	referee->started = true;
	referee->last_exposure = exposure;
	return exposure;
}

void referee_judge(struct referee *referee, const struct stage_marker_set *set, int64_t received_ns)
{
	int64_t exposure = note_exposure(referee, set);

	if (exposure < 0)
		return;
	if (referee->sets_received == 0)
		referee->number_offset = (int64_t)set->shot - exposure;
	referee->mispaired_count += (int64_t)set->shot - exposure != referee->number_offset;
	int64_t mid_ns = sim_scene_mid_exposure_ns(referee->scene, (uint64_t)exposure);
	int64_t late_ns = set->mid_exposure_ns - (referee->epoch_ns + mid_ns);
	sim_scene_truth(referee->scene, (double)mid_ns / 1e9, &referee->truth);
	histogram_add(&referee->timestamp_error_s, fabs((double)late_ns) / 1e9);
	histogram_add(&referee->latency_s, fmax(0, (double)(received_ns - set->arrival_ns)) / 1e9);
	referee->beyond_bound_count += llabs(late_ns) > set->uncertainty_ns;
	referee->sets_received++;
	referee->sets_incomplete += set->missing_mask != 0;
	referee->sets_lost = set->sets_lost;
	judge_labels(referee, set, received_ns);
}

static double percent(uint64_t part, uint64_t whole)
{
	return whole ? 100.0 * (double)part / (double)whole : 0;
}

struct results referee_results(const struct referee *referee, int64_t end_ns)
{
	struct results r = {.shots_received = referee->sets_received};
	int64_t last = nearest_exposure(referee, end_ns);

	last = referee->last_exposure > last ? referee->last_exposure : last;
	if (referee->started)
		r.shots_expected = (uint64_t)(last - referee->first_exposure + 1);
	r.shots_lost = r.shots_expected - r.shots_received;
	r.lost_percent = percent(r.shots_lost, r.shots_expected);
	r.incomplete_percent = percent(referee->sets_incomplete, r.shots_expected);
	r.rate_hz = r.shots_expected ? (double)r.shots_received / (double)r.shots_expected * 1e9 /
					       (double)sim_scene_period_ns(referee->scene)
				     : 0;
	r.error_median_mm = 1e3 * histogram_quantile(&referee->error_m, 0.5);
	r.error_p95_mm = 1e3 * histogram_quantile(&referee->error_m, 0.95);
	r.error_rms_mm = 1e3 * sqrt(referee->error_sum_m2 / (double)referee->error_m.count);
	r.right_percent = percent(referee->right_count, referee->seen_count);
	r.latency_p50_ms = 1e3 * histogram_quantile(&referee->latency_s, 0.5);
	r.latency_p99_ms = 1e3 * histogram_quantile(&referee->latency_s, 0.99);
	r.timestamp_p50_us = 1e6 * histogram_quantile(&referee->timestamp_error_s, 0.5);
	r.timestamp_max_us = 1e6 * referee->timestamp_error_s.max;
	r.accurate = r.error_median_mm <= ERROR_MEDIAN_MAX_MM; /* false for NaN */
	r.named = r.right_percent >= RIGHT_MIN_PERCENT;
	r.complete = r.shots_expected > 0 && r.lost_percent <= LOST_MAX_PERCENT;
	return r;
}
