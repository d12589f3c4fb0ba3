/*
 * The board's corners, each from all cameras that see it, and the board that suits them best; or
 * the three points that stand to each other as an L-frame's do.
 */
#include "calib/rig/origin.h"

#include <errno.h>
#include <math.h>
#include <string.h>

#include "track/match/triangulate.h"
#include "track/rigid.h"

#define CORNER_SIGMA_PX 0.05
#define CORNERS_MIN 12
#define BOARD_OFF_MAX_MM 2.0
#define ARM_OFF_M 0.005 /* an arm may be so much longer or shorter than it is said to be */
#define SQUARE_OFF 0.02 /* cosine of the angle between the arms */
#define L_SHOTS_MIN 10
#define L_OFF_MAX_MM 2.0
#define CANDIDATES_MAX 64 /* points of a shot that are looked at */

static const struct view *view_of(const struct rig *rig, const char *name)
{
	for (uint32_t c = 0; c < rig->camera_count; c++)
		if (!strcmp(rig->names[c], name))
			return &rig->views[c];
	return NULL;
}

/* The corner as the cameras of one pose, views [first, end), have it. */
static bool find_corner(const struct rig *rig, const struct observations *o, uint32_t first,
			uint32_t end, uint32_t corner, struct vec3 *p_m)
{
	struct sighting sightings[CAMERA_MAX];
	struct fix fix;
	int count = 0;

	for (uint32_t v = first; v < end; v++) {
		const double *px = observations_px(o, v)[corner];
		const struct view *view = view_of(rig, o->cameras[o->views[v].camera].name);

		if (view && isfinite(px[0]))
			sightings[count++] = (struct sighting){
				.view = view, .pixel = {px[0], px[1]}, .sigma_px = CORNER_SIGMA_PX};
	}
	if (count < 2 || triangulate(sightings, count, NULL, &fix))
		return false;
	*p_m = fix.p_stage_m;
	return true;
}

/* Means over all poses: it is at rest. Returns how many corners have one. */
static int gather_corners(struct rigid_pair *pairs, const struct rig *rig,
			  const struct observations *o)
{
	int count = 0;

	for (uint32_t corner = 0; corner < o->corner_count; corner++) {
		struct vec3 sum = {0, 0, 0}, p_m;
		uint32_t seen = 0;

		for (uint32_t v = 0, end; v < o->view_count; v = end) {
			for (end = v;
			     end < o->view_count && o->views[end].pose == o->views[v].pose;)
				end++;
			if (!find_corner(rig, o, v, end, corner, &p_m))
				continue;
			sum = vec3_add(sum, p_m);
			seen++;
		}
		if (!seen)
			continue;
		/* y down and z into the print become y up and z out of it */
		struct vec3 flat = board_corner_m(&o->board, (int)corner);
		pairs[count++] = (struct rigid_pair){
			vec3_scale(sum, 1.0 / seen), {flat.x, -flat.y, -flat.z}, seen};
	}
	return count;
}

static double rms_mm(const struct rigid_pair *pairs, int count, const struct pose *rt)
{
	double sum = 0;

	for (int i = 0; i < count; i++) {
		double off_m = rigid_error(&pairs[i], rt);

		sum += off_m * off_m;
	}
	return 1e3 * sqrt(sum / count);
}

int origin_of_board(struct origin *origin, const struct rig *rig, const struct observations *o,
		    struct diag *diag)
{
	struct rigid_pair pairs[BOARD_CORNER_MAX];
	struct pose rt;
	int count = gather_corners(pairs, rig, o);

	if (count < CORNERS_MIN || rigid_fit(pairs, count, &rt)) {
		diag_add(
			diag,
			"%d corners of the board are seen by two IR cameras at once, it takes %d; "
			"lay it where the pictures of two calibrated cameras overlap, and light it",
			count, CORNERS_MIN);
		return -EINVAL;
	}
	double off_mm = rms_mm(pairs, count, &rt);
	if (off_mm > BOARD_OFF_MAX_MM) {
		diag_add(
			diag,
			"the board's corners lie %.1f mm rms off a flat board of its size, at most "
			"%.0f mm; let it lie still while it is recorded, check square_m, and see "
			"with stagectl calibrate refine whether a camera was bumped",
			off_mm, BOARD_OFF_MAX_MM);
		return -EINVAL;
	}
	*origin = (struct origin){rt, off_mm, (uint32_t)count};
	return 0;
}

struct l_frame {
	struct vec3 corner_m, long_m, short_m; /* its three markers */
};

static bool is_arm(struct vec3 from, struct vec3 to, double arm_m)
{
	return fabs(vec3_distance(from, to) - arm_m) < ARM_OFF_M;
}

/* How many of these points are an L-frame, and one of them. */
static int find_l(const struct vec3 *p, int count, double long_m, double short_m,
		  struct l_frame *found)
{
	int matches = 0;

	for (int o = 0; o < count; o++)
		for (int a = 0; a < count; a++)
			for (int b = 0; b < count; b++) {
				if (o == a || o == b || a == b || !is_arm(p[o], p[a], long_m) ||
				    !is_arm(p[o], p[b], short_m))
					continue;
				struct vec3 x = vec3_unit(vec3_sub(p[a], p[o]));
				struct vec3 y = vec3_unit(vec3_sub(p[b], p[o]));

				if (fabs(vec3_dot(x, y)) > SQUARE_OFF)
					continue;
				*found = (struct l_frame){p[o], p[a], p[b]};
				matches++;
			}
	return matches;
}

struct l_search {
	struct l_frame sum;
	double sum2_m2; /* of the corner's and the ends' coordinates */
	uint32_t shots, found, doubtful;
};

static double square(struct vec3 v)
{
	return vec3_dot(v, v);
}

static void search_shot(struct l_search *search, const struct vec3 *p, int count, double long_m,
			double short_m)
{
	struct l_frame one = {0};
	int matches = find_l(p, count, long_m, short_m, &one);

	search->shots++;
	search->doubtful += matches > 1;
	if (matches != 1)
		return;
	search->found++;
	search->sum.corner_m = vec3_add(search->sum.corner_m, one.corner_m);
	search->sum.long_m = vec3_add(search->sum.long_m, one.long_m);
	search->sum.short_m = vec3_add(search->sum.short_m, one.short_m);
	search->sum2_m2 += square(one.corner_m) + square(one.long_m) + square(one.short_m);
}

static void search_all(struct l_search *search, const struct marker_shots *shots, double long_m,
		       double short_m)
{
	struct vec3 p[CANDIDATES_MAX];
	int count = 0;

	for (uint32_t i = 0; i < shots->point_count; i++) {
		bool last = i + 1 == shots->point_count ||
			    shots->points[i + 1].shot != shots->points[i].shot;

		if (count < CANDIDATES_MAX)
			p[count++] = shots->points[i].p_stage_m;
		if (!last)
			continue;
		search_shot(search, p, count, long_m, short_m);
		count = 0;
	}
}

/* x along the long arm, z across both. */
static struct pose frame_of(const struct l_frame *l)
{
	struct vec3 x = vec3_unit(vec3_sub(l->long_m, l->corner_m));
	struct vec3 z = vec3_unit(vec3_cross(x, vec3_sub(l->short_m, l->corner_m)));
	struct vec3 y = vec3_cross(z, x);
	struct pose rt_stage_new = {.r = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}},
				    .t = l->corner_m};

	return pose_inverse(&rt_stage_new);
}

static int check_l(const struct l_search *search, double long_m, double short_m, struct diag *diag)
{
	if (fabs(long_m - short_m) < 4 * ARM_OFF_M) {
		diag_add(diag,
			 "arms of %.0f and %.0f mm cannot be told apart: which is x? They must "
			 "differ by %.0f mm or more",
			 1e3 * long_m, 1e3 * short_m, 4e3 * ARM_OFF_M);
		return -EINVAL;
	}
	if (2 * search->doubtful > search->shots) {
		diag_add(diag,
			 "more than one set of three markers has arms of %.0f and %.0f mm: which "
			 "is the L-frame? Take the other markers away",
			 1e3 * long_m, 1e3 * short_m);
		return -EINVAL;
	}
	if (search->found < L_SHOTS_MIN) {
		diag_add(diag,
			 "three markers with arms of %.0f and %.0f mm (to %.0f mm) at a right "
			 "angle were found in %u of %u shots, it takes %d; measure the arms, and "
			 "lay the L-frame where two or more cameras see all of it",
			 1e3 * long_m, 1e3 * short_m, 1e3 * ARM_OFF_M, search->found, search->shots,
			 L_SHOTS_MIN);
		return -EINVAL;
	}
	return 0;
}

/* Cameras stand above the floor. */
static int check_up(const struct rig *rig, const struct pose *rt_new_stage, struct diag *diag)
{
	uint32_t below = 0;

	for (uint32_t c = 0; c < rig->camera_count; c++)
		below += pose_apply(rt_new_stage, rig->views[c].centre_stage_m).z < 0;
	if (2 * below <= rig->camera_count)
		return 0;
	diag_add(diag,
		 "z would point down: %u of %u cameras would be below the floor; seen from "
		 "above, the short arm must be to the left of the long one: turn the L-frame "
		 "over",
		 below, rig->camera_count);
	return -EINVAL;
}

int origin_of_l_frame(struct origin *origin, const struct rig *rig,
		      const struct marker_shots *shots, double long_m, double short_m,
		      struct diag *diag)
{
	struct l_search s = {0};

	search_all(&s, shots, long_m, short_m);
	int err = check_l(&s, long_m, short_m, diag);
	if (err)
		return err;
	double part = 1.0 / s.found;
	struct l_frame mean = {vec3_scale(s.sum.corner_m, part), vec3_scale(s.sum.long_m, part),
			       vec3_scale(s.sum.short_m, part)};
	double spread_m2 = s.sum2_m2 * part - square(mean.corner_m) - square(mean.long_m) -
			   square(mean.short_m);
	double off_mm = 1e3 * sqrt(fmax(0, spread_m2) / 3);
	struct pose rt = frame_of(&mean);

	if (off_mm > L_OFF_MAX_MM) {
		diag_add(diag,
			 "the L-frame's markers move by %.1f mm, at most %.0f mm; let it lie "
			 "still",
			 off_mm, L_OFF_MAX_MM);
		return -EINVAL;
	}
	err = check_up(rig, &rt, diag);
	if (!err)
		*origin = (struct origin){rt, off_mm, 3 * s.found};
	return err;
}
