/*
 * The steps of a calibration behind the gathering, in order.
 */
#include "ctl/calibrate/calibrate_make.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "calib/report/report.h"
#include "calib/rig/rig_store.h"
#include "calib/rig/rig_write.h"
#include "calib/solve/scale_check.h"
#include "ctl/calibrate/calibrate_finish.h"
#include "ctl/calibrate/calibrate_screen.h"

#ifndef STAGE_VERSION
#error "STAGE_VERSION comes from meson"
#endif

static int find_before(struct calibrate_making *k, struct diag *diag)
{
	k->before_number = rig_store_in_force(k->rig_dir);
	int err = rig_before(&k->before, k->rig_dir, k->observations);

	return err ? err : rig_before_check_sizes(&k->before, k->rig_dir, k->observations, diag);
}

static int solve_all(struct calibrate_making *k, struct diag *diag)
{
	struct solve_settings settings = SOLVE_SETTINGS_DEFAULT;
	const struct observations *o = k->observations;

	settings.lens = k->lens;
	int err = seed_make(&k->seed, o, diag);
	if (!err)
		err = solve(&k->solution, o, &k->seed, &settings, diag);
	if (!err)
		err = volume_of_poses(&k->volume, &k->solution, o);
	if (!err)
		err = uncertainty_find(&k->uncertainty, &k->solution, o, &k->volume);
	if (err == -EDOM) {
		diag_add(diag, "no part of the volume is seen by two cameras; wave the board where "
			       "their images overlap");
		return -EINVAL;
	}
	if (!err)
		err = cross_check(&k->check, o, &k->seed, &k->solution, &k->volume, &settings,
				  diag);
	return err;
}

static void judge(struct calibrate_making *k, struct diag *diag)
{
	struct diag quiet = {0};

	k->verdict = verdict_of(&k->calibration->limits, k->observations, &k->solution,
				&k->uncertainty, &k->check);
	k->rt_stage_ref = rig_before_frame(&k->before, k->observations, &k->solution, k->moves);
	k->worst = where_next(&k->uncertainty, &k->volume, &k->solution, k->observations,
			      &k->rt_stage_ref);
	k->scale = 1;
	if (scale_has_changed(k->observations, &k->solution, &k->before, &k->scale,
			      k->accept_scale ? &quiet : diag) &&
	    !k->accept_scale) {
		diag_add(diag, "if this print is the right one, say --accept-scale");
		k->verdict.passed = false;
		k->scale_refused = true;
	}
	diag_finish(&quiet);
}

static int write_report(const struct calibrate_making *k, const struct rig_facts *rig,
			struct diag *diag)
{
	char path[PATH_MAX], before[16] = "", words[WHERE_WORDS_BYTES];

	if (snprintf(path, sizeof(path), "%s/report.html", k->revision_dir) >= PATH_MAX)
		return -ENAMETOOLONG;
	if (k->before_number)
		snprintf(before, sizeof(before), "%04u", k->before_number);
	where_next_words(&k->worst, k->observations, words);
	const struct report_facts facts = {.rig = rig,
					   .wave_next = words,
					   .scale_refused = k->scale_refused,
					   .revision = k->revision,
					   .coverage = k->coverage,
					   .moves = k->moves,
					   .before = k->before.camera_count && !*before ? "before"
											: before,
					   .scale = k->scale};
	return report_write(path, &facts, diag);
}

static int keep_corners(const struct calibrate_making *k, struct diag *diag)
{
	char path[PATH_MAX];

	if (snprintf(path, sizeof(path), "%s/corners.vnl", k->revision_dir) >= PATH_MAX)
		return -ENAMETOOLONG;
	if (!rename(k->kept_path, path))
		return 0;
	int err = -errno;
	diag_add(diag, "%s: cannot write: %s", path, strerror(-err));
	return err;
}

static int write_rig(struct calibrate_making *k, struct diag *diag)
{
	const struct rig_facts rig = {.software = "stage " STAGE_VERSION,
				      .observations = k->observations,
				      .solution = &k->solution,
				      .volume = &k->volume,
				      .uncertainty = &k->uncertainty,
				      .cross_check = &k->check,
				      .verdict = &k->verdict,
				      .rt_stage_ref = k->rt_stage_ref};
	uint32_t kept;
	int err = rig_store_next(k->rig_dir, &k->number, diag);

	if (!err)
		err = rig_store_revision_path(k->revision_dir, k->rig_dir, k->number, diag);
	if (!err)
		err = rig_write(k->revision_dir, &rig, k->revision, diag);
	if (!err)
		err = write_report(k, &rig, diag);
	if (!err)
		err = keep_corners(k, diag);
	if (!err && k->verdict.passed)
		err = rig_store_put_in_force(k->rig_dir, k->number, &kept, diag);
	return err;
}

int calibrate_make(struct calibrate_making *k, struct diag *diag)
{
	int err = find_before(k, diag);

	if (!err)
		err = solve_all(k, diag);
	if (err)
		return err;
	judge(k, diag);
	err = write_rig(k, diag);
	if (!err)
		calibrate_finish(k);
	return err;
}

void calibrate_making_finish(struct calibrate_making *k)
{
	seed_finish(&k->seed);
	solution_finish(&k->solution);
	rig_finish(&k->before);
}

void calibrate_making_print(const struct calibrate_making *k)
{
	char words[WHERE_WORDS_BYTES];

	where_next_words(&k->worst, k->observations, words);
	screen_verdict(&k->verdict);
	printf("to make it better, wave next at the worst place: %s\n", words);
	printf("%s: revision %04u, %s; report: %s/report.html\n", k->rig_dir, k->number,
	       k->verdict.passed ? "in force" : "NOT in force: the rig from before stays",
	       k->revision_dir);
}

static json_t *where_json(const struct calibrate_making *k)
{
	char words[WHERE_WORDS_BYTES];
	const struct vec3 *p = &k->worst.p_stage_m;
	json_t *cameras = json_array();

	where_next_words(&k->worst, k->observations, words);
	for (uint32_t i = 0; i < k->worst.camera_count; i++) {
		uint32_t c = k->worst.cameras[i].camera;
		const double *px = k->worst.cameras[i].px;

		json_array_append_new(
			cameras,
			json_pack("{s:s, s:s, s:[f,f], s:f}", "name",
				  k->observations->cameras[c].name, "region",
				  coverage_region_name(&k->observations->cameras[c], px), "px",
				  px[0], px[1], "range_m", k->worst.cameras[i].range_m));
	}
	return json_pack("{s:s, s:[f,f,f], s:f, s:i, s:o}", "words", words, "p_stage_m", p->x, p->y,
			 p->z, "sigma_mm", 1e3 * k->worst.sigma_m, "seen_by", (int)k->worst.seen_by,
			 "cameras", cameras);
}

json_t *calibrate_making_json(const struct calibrate_making *k)
{
	return json_pack("{s:s, s:i, s:s, s:s, s:b, s:f, s:f, s:f, s:f, s:i, s:o, s:o}", "rig",
			 k->rig_dir, "number", (int)k->number, "dir", k->revision_dir, "revision",
			 k->revision, "passed", k->verdict.passed, "rms_px", k->solution.rms_px,
			 "held_out_px", k->check.held_out_rms_px, "uncertainty_mm",
			 1e3 * k->uncertainty.rms_m, "worst_mm", 1e3 * k->uncertainty.worst_m,
			 "poses", (int)k->solution.pose_count, "limits",
			 screen_verdict_json(&k->verdict), "wave_next", where_json(k));
}
