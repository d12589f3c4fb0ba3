/*
 * Judges a stream against the truth of the simulated scene. Pure: the caller says what came and
 * when.
 *
 * A set is compared with the truth at the exposure of the scene nearest to its mid_exposure_ns; how
 * far off that time is, is reported apart. A label is right when its marker is measured (by two
 * cameras or more) within 3 mm of its own true place, wrong when it is measured elsewhere, and
 * swapped when that elsewhere is within 3 mm of another marker. Predicted and missing ones are
 * unlabelled. Right labels count among those markers that three or more cameras truly see; wrong
 * ones count always. Errors are those of right labels seen and measured by three or more cameras.
 */
#pragma once

#include "protocol/stage_client.h"
#include "sim/world/scene.h"

#define REFEREE_NEAR_M 0.003

/* Counts in bins of equal width from 0 on; what is larger goes into the last. */
struct histogram {
	double bin_width;
	uint64_t bins[8192];
	uint64_t count;
	double max;
};

struct label_view {
	const char *name; /* the scene's */
	int status;       /* enum stage_marker_status */
	uint32_t camera_count;
	double error_m; /* 0 unless there is a position */
};

struct referee {
	const struct sim_scene *scene; /* borrowed */
	int64_t epoch_ns;
	struct pose rt_scene_station; /* of a station whose frame is its own; else the identity */
	uint32_t label_count;
	uint32_t truth_of_label[LABEL_MAX];
	struct label_view views[LABEL_MAX]; /* of the latest set, by the station's labels */
	struct sim_truth truth;

	bool started;
	int64_t first_exposure, last_exposure; /* of the scene */
	uint64_t sets_received, sets_repeated, sets_incomplete;
	uint64_t mispaired_count; /* sets whose number is not that of their exposure */
	int64_t number_offset;    /* from exposures to numbers, of the first set */
	uint64_t sets_lost;       /* as the station tells */
	uint64_t seen_count, right_count, unlabelled_count; /* of markers three cameras truly see */
	uint64_t wrong_count, swapped_count;                /* of all */
	uint64_t beyond_bound_count; /* sets whose time is further off than their uncertainty_ns */
	int64_t first_label_ns;      /* when the first right label was received; 0 = not yet */
	double error_sum_m2;
	struct histogram error_m, latency_s, timestamp_error_s;
};

struct results {
	uint64_t shots_expected, shots_received, shots_lost;
	double rate_hz;
	double error_median_mm, error_p95_mm, error_rms_mm;
	double right_percent, lost_percent, incomplete_percent;
	double latency_p50_ms, latency_p99_ms;
	double timestamp_p50_us, timestamp_max_us;
	bool accurate, named, complete; /* the three conditions of a pass */
};

/* `epoch_ns` is scene time 0 on CLOCK_MONOTONIC. */
void referee_init(struct referee *referee, const struct sim_scene *scene, int64_t epoch_ns);

/* Returns 0, or -EINVAL when the description has labels that the scene does not know. */
int referee_describe(struct referee *referee, const struct stage_description *description);

/* Sets `truth` to that of the exposure nearest to a time of the station. */
void referee_find_truth(struct referee *referee, int64_t mid_exposure_ns);

void referee_judge(struct referee *referee, const struct stage_marker_set *set,
		   int64_t received_ns);

/* Shots count up to the last received or those exposed by `end_ns`, whichever is later. */
struct results referee_results(const struct referee *referee, int64_t end_ns);
