/*
 * The aim of each camera as the station watches it, over the whole take: a camera is named when it
 * was off in two answers at least; and what its spots leave over, against their own noise.
 */
#include "ctl/rig_fit.h"

#include <math.h>
#include <stdlib.h>

#include "track/aim_check.h"
#include "track/sync/ledger.h"

#define ANSWERS_MIN 2
#define RESIDUAL_MAX_PX 0.3 /* rms of a good rig is a tenth */
#define LOOK_EVERY 4        /* shots: residuals of each camera */
#define LOOK_CAMERAS_MIN 4  /* fewer do not tell which of them is off */
#define LOOK_PX 1.5         /* its spot lies within */
#define LOOK_MIN 100        /* spots, before a camera is judged */
#define ROUGH_SIGMAS 3.0    /* a camera leaves over so much ... */
#define ROUGH_RATIO 2.0     /* ... and so many times as much as the middle one */

/* What one camera's spots leave over, in pixels and in their own sigmas. */
struct residuals {
	double px2, sigmas2; /* sums, per axis */
	uint64_t count;
};

struct rig_fit {
	const struct stage *stage;
	struct aim_check check;
	uint32_t answers;
	uint32_t off[CAMERA_MAX];      /* answers that say it is off */
	uint32_t left_out[CAMERA_MAX]; /* ... that most of its spots fit no point */
	struct aim worst[CAMERA_MAX];
	double residual2_px2;
	uint64_t measured;
	uint64_t shots;
	struct residuals cameras[CAMERA_MAX];
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

static const struct blob *spot_near(const struct blob_set *set, const double pixel[2])
{
	const struct blob *nearest = NULL;
	double least_px = LOOK_PX;

	for (uint32_t b = 0; b < set->blob_count; b++) {
		const struct blob *blob = &set->blobs[b];
		double off_px = hypot(blob->x_px - pixel[0], blob->y_px - pixel[1]);

		if (off_px < least_px) {
			least_px = off_px;
			nearest = blob;
		}
	}
	return nearest;
}

/* A marker is drawn to each of its views, so that less is left over than the view is off. */
static void add_view(struct residuals *r, const struct blob *blob, const double pixel[2],
		     double free_share, double rig_sigma_px)
{
	double x_px = blob->x_px - pixel[0], y_px = blob->y_px - pixel[1];
	double sigma2_px2 = blob->sigma_px * blob->sigma_px + rig_sigma_px * rig_sigma_px;
	double px2 = (x_px * x_px + y_px * y_px) / (2 * free_share);

	r->px2 += px2;
	r->sigmas2 += px2 / sigma2_px2;
	r->count++;
}

static void add_marker(struct rig_fit *fit, const struct shot *shot, const struct marker *marker)
{
	const struct tracker_rig *rig = &fit->stage->tracking;
	double free_share = 1 - 1.5 / marker->camera_count;
	double pixel[2], slopes[2][3];

	for (uint32_t left = marker->camera_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		if (!shot->sets[c] ||
		    !view_project(rig->views[c], marker->p_stage_m, pixel, slopes))
			continue;
		const struct blob *blob = spot_near(shot->sets[c], pixel);
		if (blob && !blob->flags)
			add_view(&fit->cameras[c], blob, pixel, free_share,
				 rig->settings.calibration_sigma_px);
	}
}

static void add_cameras(struct rig_fit *fit, const struct shot *shot, const struct marker_set *set)
{
	if (fit->shots++ % LOOK_EVERY != 0)
		return;
	for (uint32_t i = 0; i < set->label_count; i++)
		if (set->markers[i].status == MARKER_MEASURED &&
		    set->markers[i].camera_count >= LOOK_CAMERAS_MIN)
			add_marker(fit, shot, &set->markers[i]);
}

void rig_fit_step(struct rig_fit *fit, const struct shot *shot, const struct marker_set *set)
{
	add_residuals(fit, set);
	add_cameras(fit, shot, set);
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

static double rms_sigmas(const struct residuals *r)
{
	return r->count ? sqrt(r->sigmas2 / (double)r->count) : 0;
}

static double rms_px(const struct residuals *r)
{
	return r->count ? sqrt(r->px2 / (double)r->count) : 0;
}

static int by_value(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

/* Of the cameras that saw enough; 0 when none did. */
static double middle_sigmas(const struct rig_fit *fit)
{
	double sigmas[CAMERA_MAX];
	size_t count = 0;

	for (uint32_t c = 0; c < CAMERA_MAX; c++)
		if (fit->cameras[c].count >= LOOK_MIN)
			sigmas[count++] = rms_sigmas(&fit->cameras[c]);
	qsort(sigmas, count, sizeof(sigmas[0]), by_value);
	return count ? sigmas[(count - 1) / 2] : 0;
}

/* Its own spots fit worse than those of the others do. */
static bool is_rough(const struct rig_fit *fit, uint32_t camera)
{
	const struct residuals *r = &fit->cameras[camera];

	return r->count >= LOOK_MIN && rms_sigmas(r) > ROUGH_SIGMAS &&
	       rms_sigmas(r) > ROUGH_RATIO * middle_sigmas(fit);
}

/* False when it is not. */
static bool print_rough(const struct rig_fit *fit, uint32_t camera, FILE *out)
{
	const struct residuals *r = &fit->cameras[camera];

	if (!is_rough(fit, camera))
		return false;
	fprintf(out,
		"camera %s: its spots are off by %.2f pixels rms, %.1f times their own noise and "
		"far more than the other cameras': stagectl calibrate refine\n",
		fit->stage->config.cameras[camera].name, rms_px(r), rms_sigmas(r));
	return true;
}

/* False when the camera is where the rig has it. */
static bool print_camera(const struct rig_fit *fit, uint32_t camera, FILE *out)
{
	const struct aim *worst = &fit->worst[camera];

	if (!is_moved(fit, camera) && !is_left_out(fit, camera))
		return print_rough(fit, camera, out);
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

static json_t *cameras_json(const struct rig_fit *fit)
{
	const struct config *config = &fit->stage->config;
	json_t *cameras = json_array();

	for (uint32_t c = 0; c < config->camera_count; c++) {
		const struct residuals *r = &fit->cameras[c];

		if (r->count)
			json_array_append_new(cameras, json_pack("{s:s, s:f, s:f}", "camera",
								 config->cameras[c].name,
								 "residual_px", rms_px(r),
								 "residual_sigmas", rms_sigmas(r)));
	}
	return cameras;
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
	return json_pack("{s:o, s:o, s:o}", "residual_px",
			 fit->measured ? json_real(residual_px(fit)) : json_null(), "moved", moved,
			 "cameras", cameras_json(fit));
}
