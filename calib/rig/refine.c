/*
 * Which cameras moved: the one whose step explains most of what is left over is freed, all freed
 * ones are solved, and so on until nobody's step would move its pictures.
 */
#include "calib/rig/refine.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calib/rig/refine_parts.h"

#define MOVED_PX 0.03 /* less is left as it is */
#define VIEWS_MIN 150 /* of a camera that is judged */
#define LABELS_MIN 8
#define FIXED_MIN 2     /* cameras that hold the stage frame and its scale */
#define LEFT_MAX_PX 0.3 /* rms after it */
#define HALVES_MAX_PX 0.1

struct refinement {
	struct refine_problem problem;
	struct refine_normal normal;
};

static void count_labels(const struct refine_problem *problem, uint32_t *label_counts,
			 uint32_t *all)
{
	static const uint32_t words = LABEL_MAX / 32;
	uint32_t seen[CAMERA_MAX + 1][LABEL_MAX / 32] = {{0}};

	for (uint32_t p = 0; p < problem->point_count; p++) {
		const struct refine_point *point = &problem->points[p];
		if (point->label < 0)
			continue;
		uint32_t word = (uint32_t)point->label / 32, bit = 1u << (point->label % 32);

		seen[CAMERA_MAX][word] |= bit;
		for (uint32_t v = 0; v < point->view_count; v++)
			seen[problem->views[point->first_view + v].camera][word] |= bit;
	}
	*all = 0;
	for (uint32_t w = 0; w < words; w++)
		*all += (uint32_t)__builtin_popcount(seen[CAMERA_MAX][w]);
	for (uint32_t c = 0; c < problem->camera_count; c++) {
		label_counts[c] = 0;
		for (uint32_t w = 0; w < words; w++)
			label_counts[c] += (uint32_t)__builtin_popcount(seen[c][w]);
	}
}

static double left_px(const struct refine_normal *n, uint32_t camera)
{
	return n->weight[camera] > 0 ? sqrt(n->left_px2[camera] / n->weight[camera]) : 0;
}

/* Fills what the refined ones begin with. */
static uint32_t judge_data(struct refined *out, const struct refinement *r)
{
	uint32_t label_counts[CAMERA_MAX], judged = 0;

	count_labels(&r->problem, label_counts, &out->marker_count);
	for (uint32_t c = 0; c < out->camera_count; c++) {
		struct refined_camera *camera = &out->cameras[c];

		camera->view_count = r->normal.view_count[c];
		camera->judged = camera->view_count >= VIEWS_MIN &&
				 (!out->named || label_counts[c] >= LABELS_MIN);
		camera->before_px = left_px(&r->normal, c);
		judged += camera->judged;
	}
	return judged;
}

static int too_few(const struct refined *out, uint32_t judged, const struct rig *rig,
		   struct diag *diag)
{
	if (out->shot_count < REFINE_SHOTS_MIN) {
		diag_add(diag,
			 "%u shots with markers are too few, it takes %d; let the actor be seen "
			 "for longer (--seconds); if cameras were moved far, make the rig anew: "
			 "stagectl calibrate cameras",
			 out->shot_count, REFINE_SHOTS_MIN);
		return -EINVAL;
	}
	if (judged > FIXED_MIN)
		return 0;
	for (uint32_t c = 0; c < out->camera_count; c++)
		if (!out->cameras[c].judged)
			diag_add(diag,
				 "camera %s: %u views of markers are too few, it takes "
				 "%d of %d markers; bring the actor where it sees them",
				 rig->names[c], out->cameras[c].view_count, VIEWS_MIN, LABELS_MIN);
	diag_add(diag,
		 "%u cameras can be judged, which is too few to say who moved; if cameras were "
		 "moved far, make the rig anew: stagectl calibrate cameras",
		 judged);
	return -EINVAL;
}

/* The camera that is to be freed next; false: none. */
static bool find_moved(const struct refined *out, const struct refine_normal *n, uint32_t *moved)
{
	double most = 0;

	for (uint32_t c = 0; c < out->camera_count; c++) {
		double step[REFINE_DOF], off_px = 0;

		if (!out->cameras[c].judged || out->cameras[c].moved)
			continue;
		double explained = refine_explain(n, c, step, &off_px);
		if (explained > most && off_px >= MOVED_PX) {
			most = explained;
			*moved = c;
		}
	}
	return most > 0;
}

static int free_moved(struct refinement *r, struct refined *out, uint32_t judged,
		      const struct rig *rig, struct diag *diag)
{
	uint32_t moved;

	while (find_moved(out, &r->normal, &moved)) {
		if (out->moved_count + FIXED_MIN >= judged) {
			diag_add(diag,
				 "more than %u of %u cameras do not look where the rig says, the "
				 "last of them %s: nothing holds the stage frame; make the rig "
				 "anew: stagectl calibrate cameras",
				 out->moved_count, judged, rig->names[moved]);
			return -EINVAL;
		}
		out->cameras[moved].moved = true;
		r->normal.free_cameras[out->moved_count++] = moved;
		r->normal.free_count = out->moved_count;
		int err = refine_solve(&r->problem, &r->normal);
		if (err == -EDOM)
			diag_add(diag,
				 "camera %s: its markers do not tell where it stands; let the "
				 "actor move through the volume",
				 rig->names[moved]);
		if (err)
			return err == -EDOM ? -EINVAL : err;
	}
	return 0;
}

/* How far its pictures lie apart by two poses, rms over its markers. */
static double apart_px(const struct refine_problem *problem, const struct view *one,
		       const struct view *other, uint32_t camera)
{
	double sum = 0;
	uint32_t count = 0;

	for (uint32_t p = 0; p < problem->point_count; p++) {
		const struct refine_point *point = &problem->points[p];
		double a[2], b[2];
		bool seen = false;

		for (uint32_t v = 0; v < point->view_count; v++)
			seen |= problem->views[point->first_view + v].camera == camera;
		if (!seen || !view_project(one, point->p_stage_m, a, NULL) ||
		    !view_project(other, point->p_stage_m, b, NULL))
			continue;
		sum += (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
		count++;
	}
	return count ? sqrt(sum / count) : 0;
}

static void describe(const struct refinement *r, struct refined *out, const struct rig *rig)
{
	for (uint32_t c = 0; c < out->camera_count; c++) {
		struct refined_camera *camera = &out->cameras[c];
		const struct view *now = &r->problem.cameras[c];
		struct pose back = pose_inverse(&rig->views[c].rt_cam_stage);
		struct pose turned = pose_compose(&now->rt_cam_stage, &back);

		camera->rt_cam_stage = now->rt_cam_stage;
		camera->after_px = left_px(&r->normal, c);
		if (!camera->moved)
			continue;
		camera->off_px = apart_px(&r->problem, now, &rig->views[c], c);
		camera->turned_mrad = 1e3 * vec3_norm(pose_to_rotation_vector(&turned));
		camera->moved_mm =
			1e3 * vec3_distance(now->centre_stage_m, rig->views[c].centre_stage_m);
	}
}

/* Even and odd shots must say the same. */
static int check_halves(struct refinement *r, const struct refined *out, const struct rig *rig,
			struct diag *diag)
{
	struct view halves[2][CAMERA_MAX], all[CAMERA_MAX];
	int err = 0;

	memcpy(all, r->problem.cameras, sizeof(all));
	for (int half = 0; !err && half < 2; half++) {
		memcpy(r->problem.cameras, all, sizeof(all));
		r->problem.half = half + 1;
		err = refine_solve(&r->problem, &r->normal);
		memcpy(halves[half], r->problem.cameras, sizeof(all));
	}
	memcpy(r->problem.cameras, all, sizeof(all));
	r->problem.half = 0;
	for (uint32_t c = 0; !err && c < out->camera_count; c++) {
		double px = apart_px(&r->problem, &halves[0][c], &halves[1][c], c);

		if (!out->cameras[c].moved || px <= HALVES_MAX_PX)
			continue;
		diag_add(diag,
			 "camera %s: half of the shots puts its markers %.2f px from where the "
			 "other "
			 "half does; let the actor move through the volume, for longer (--seconds)",
			 rig->names[c], px);
		err = -EINVAL;
	}
	return err == -EDOM ? -EINVAL : err;
}

static int check_left(const struct refined *out, const struct rig *rig, struct diag *diag)
{
	int err = 0;

	for (uint32_t c = 0; c < out->camera_count; c++)
		if (out->cameras[c].judged && out->cameras[c].after_px > LEFT_MAX_PX) {
			diag_add(diag,
				 "camera %s: its markers still lie %.2f px off, at most %.1f; it "
				 "still moves, or its lens was changed: fix it, then stagectl "
				 "calibrate cameras",
				 rig->names[c], out->cameras[c].after_px, LEFT_MAX_PX);
			err = -EINVAL;
		}
	return err;
}

static int run(struct refinement *r, struct refined *out, const struct rig *rig, struct diag *diag)
{
	for (int pass = 0; pass < 3; pass++) /* the points settle, far views lose their weight */
		refine_pass(&r->problem, &r->normal);
	uint32_t judged = judge_data(out, r);
	int err = too_few(out, judged, rig, diag);
	if (!err)
		err = free_moved(r, out, judged, rig, diag);
	if (!err)
		describe(r, out, rig);
	if (!err)
		err = check_left(out, rig, diag);
	if (!err && out->moved_count)
		err = check_halves(r, out, rig, diag);
	return err;
}

/* Shots with enough points to be of use. */
static uint32_t count_shots(const struct marker_shots *shots, bool named_only)
{
	uint32_t count = 0, in_shot = 0;

	for (uint32_t p = 0; p < shots->point_count; p++) {
		if (p > 0 && shots->points[p].shot != shots->points[p - 1].shot)
			in_shot = 0;
		in_shot += shots->points[p].label >= 0 || !named_only;
		count += in_shot == LABELS_MIN;
		in_shot += in_shot == LABELS_MIN; /* counted once */
	}
	return count;
}

int refine(struct refined *refined, const struct rig *rig, const struct marker_shots *shots,
	   struct diag *diag)
{
	struct refinement *r = calloc(1, sizeof(*r));
	struct refined *out = calloc(1, sizeof(*out));
	bool named = count_shots(shots, true) >= REFINE_SHOTS_MIN;
	int err = r && out ? refine_match(&r->problem, rig, shots, named) : -ENOMEM;

	if (!err) {
		out->camera_count = rig->camera_count;
		out->named = named;
		out->shot_count = count_shots(shots, named);
		err = run(r, out, rig, diag);
		refine_problem_finish(&r->problem);
	}
	if (!err)
		*refined = *out;
	free(r);
	free(out);
	return err;
}
