/*
 * The aim of each camera as the station watches it, over the whole take: a camera is named when it
 * was off in two answers at least.
 */
#include "ctl/rig_fit.h"

#include <math.h>
#include <stdlib.h>

#include "track/aim_check.h"
#include "track/ledger.h"

#define ANSWERS_MIN 2
#define RESIDUAL_MAX_PX 0.3 /* rms of a good rig is a tenth */

struct rig_fit {
	const struct stage *stage;
	struct aim_check check;
	uint32_t answers;
	uint32_t off[CAMERA_MAX];      /* answers that say it is off */
	uint32_t left_out[CAMERA_MAX]; /* ... that most of its spots fit no point */
	struct aim worst[CAMERA_MAX];
	double residual2_px2;
	uint64_t measured;
};

struct rig_fit *rig_fit_create(const struct stage *stage)
{
	struct rig_fit *fit = calloc(1, sizeof(*fit));

	if (fit)
		fit->stage = stage;
	return fit;
}

void rig_fit_destroy(struct rig_fit *fit)
{
	free(fit);
}

static void add_residuals(struct rig_fit *fit, const struct marker_set *set)
{
	for (uint32_t i = 0; i < set->label_count; i++) {
		double residual_px = (double)set->markers[i].residual_px;

		if (set->markers[i].status != MARKER_MEASURED)
			continue;
		fit->residual2_px2 += residual_px * residual_px;
		fit->measured++;
	}
}

void rig_fit_step(struct rig_fit *fit, const struct shot *shot, const struct marker_set *set)
{
	add_residuals(fit, set);
	if (!aim_check_run(&fit->check, &fit->stage->tracking, shot, set))
		return;
	fit->answers++;
	for (uint32_t c = 0; c < shot->camera_count; c++) {
		const struct aim *aim = &fit->check.aims[c];

		fit->left_out[c] += fit->check.doubted_mask >> c & 1;
		if (aim->shift_px < LEDGER_MOVED_PX)
			continue;
		fit->off[c]++;
		if (aim->shift_px > fit->worst[c].shift_px)
			fit->worst[c] = *aim;
	}
}

static double residual_px(const struct rig_fit *fit)
{
	return fit->measured ? sqrt(fit->residual2_px2 / (double)fit->measured) : 0;
}

static bool is_moved(const struct rig_fit *fit, uint32_t camera)
{
	return fit->off[camera] >= ANSWERS_MIN;
}

/* So far off that it is seldom used, and with too few names to tell how far. */
static bool is_left_out(const struct rig_fit *fit, uint32_t camera)
{
	return fit->left_out[camera] >= ANSWERS_MIN && 2 * fit->left_out[camera] > fit->answers;
}

/* False when the camera is where the rig has it. */
static bool print_camera(const struct rig_fit *fit, uint32_t camera, FILE *out)
{
	const struct aim *worst = &fit->worst[camera];

	if (!is_moved(fit, camera) && !is_left_out(fit, camera))
		return false;
	fprintf(out, "camera %s: ", fit->stage->config.cameras[camera].name);
	if (worst->shift_px >= AIM_FAR_PX)
		fprintf(out, "hardly any marker is within %.0f pixels of its place", AIM_FAR_PX);
	else if (is_moved(fit, camera))
		fprintf(out, "its picture is off by up to %.2f pixels", worst->shift_px);
	else
		fprintf(out, "most of its spots do not fit what the others see");
	fprintf(out, ": it was moved, or the rig is of another day; stagectl calibrate refine\n");
	return true;
}

void rig_fit_print(const struct rig_fit *fit, FILE *out)
{
	const struct config *config = &fit->stage->config;
	bool any = false;

	for (uint32_t c = 0; c < config->camera_count; c++)
		any |= print_camera(fit, c, out);
	if (!any && residual_px(fit) > RESIDUAL_MAX_PX)
		fprintf(out,
			"rig %s: the cameras disagree by %.2f pixels rms, and no single one "
			"explains it; stagectl calibrate cameras\n",
			config->rig_dir, residual_px(fit));
}

json_t *rig_fit_json(const struct rig_fit *fit)
{
	const struct config *config = &fit->stage->config;
	json_t *moved = json_array();

	for (uint32_t c = 0; c < config->camera_count; c++)
		if (is_moved(fit, c) || is_left_out(fit, c))
			json_array_append_new(moved, json_pack("{s:s, s:f, s:f}", "camera",
							       config->cameras[c].name, "shift_px",
							       fit->worst[c].shift_px, "turn_mrad",
							       fit->worst[c].turn_mrad));
	return json_pack("{s:f, s:o}", "residual_px", residual_px(fit), "moved", moved);
}
