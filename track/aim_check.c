/*
 * Per marker one step of least squares over all its views; what it leaves over, and how much of a
 * shift it would have left over, are summed per camera.
 */
#include "track/aim_check.h"

#include <string.h>

#define LABELS_A_SHOT 6
#define FOUND_MIN 200  /* views of a camera, until it has an answer */
#define FAR_SHARE 0.08 /* a camera that finds fewer of its markers is far off */
#define FAR_BLOBS 16   /* though it sees as many spots */
#define FREE_MIN 0.02  /* of a view: less tells nothing */

/* One camera's view of a marker. */
struct sight {
	uint32_t camera;
	double e_px[2]; /* spot - projection */
	double j[2][3]; /* of the projection by the point, px/m */
};

/* How many spots are near the place, and one of them. */
static uint32_t find_blobs(const struct blob_set *set, const double pixel[2],
			   const struct blob **found)
{
	uint32_t count = 0;

	for (uint32_t b = 0; b < set->blob_count; b++) {
		double x_px = set->blobs[b].x_px - pixel[0], y_px = set->blobs[b].y_px - pixel[1];

		if (x_px * x_px + y_px * y_px >= AIM_FAR_PX * AIM_FAR_PX)
			continue;
		*found = &set->blobs[b];
		count++;
	}
	return count;
}

static uint32_t find_sights(struct aim_check *check, const struct tracker_rig *rig,
			    const struct shot *shot, struct vec3 p_m, struct sight *sights)
{
	uint32_t count = 0;

	for (uint32_t c = 0; c < rig->camera_count; c++) {
		struct sight *sight = &sights[count];
		double pixel[2];

		if (!rig->views[c] || !shot->sets[c] || shot->sets[c]->blob_count < FAR_BLOBS ||
		    !view_project(rig->views[c], p_m, pixel, sight->j))
			continue;
		const struct blob *blob = NULL;
		uint32_t near_count = find_blobs(shot->sets[c], pixel, &blob);

		if (near_count > 1)
			continue; /* which? */
		check->cameras[c].tried++;
		if (!blob || blob->flags)
			continue;
		check->cameras[c].found++;
		sight->camera = c;
		sight->e_px[0] = blob->x_px - pixel[0];
		sight->e_px[1] = blob->y_px - pixel[1];
		count++;
	}
	return count;
}

/* Of a symmetric matrix, by its adjugate; false when it has none. */
static bool invert(double n[3][3], double out[3][3])
{
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++) {
			int a = (k + 1) % 3, b = (k + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;

			out[i][k] = n[a][c] * n[b][d] - n[a][d] * n[b][c];
		}
	double determinant = n[0][0] * out[0][0] + n[0][1] * out[1][0] + n[0][2] * out[2][0];

	if (!(determinant > 0))
		return false;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			out[i][k] /= determinant;
	return true;
}

/* Sums j' j and j' e. */
static void add_normal(const struct sight *sight, double n[3][3], double g[3])
{
	for (int row = 0; row < 2; row++)
		for (int i = 0; i < 3; i++) {
			g[i] += sight->j[row][i] * sight->e_px[row];
			for (int k = 0; k < 3; k++)
				n[i][k] += sight->j[row][i] * sight->j[row][k];
		}
}

static void add_left(struct aim_check *check, const struct sight *sight, double inverse[3][3],
		     const double step_m[3])
{
	double taken[2][3]; /* j inverse */

	for (int row = 0; row < 2; row++) {
		double left_px = sight->e_px[row];

		for (int k = 0; k < 3; k++) {
			left_px -= sight->j[row][k] * step_m[k];
			taken[row][k] = sight->j[row][0] * inverse[0][k] +
					sight->j[row][1] * inverse[1][k] +
					sight->j[row][2] * inverse[2][k];
		}
		check->cameras[sight->camera].left_px[row] += left_px;
	}
	for (int row = 0; row < 2; row++)
		for (int column = 0; column < 2; column++)
			check->cameras[sight->camera].free[row][column] +=
				(row == column) - taken[row][0] * sight->j[column][0] -
				taken[row][1] * sight->j[column][1] -
				taken[row][2] * sight->j[column][2];
}

static void add_marker(struct aim_check *check, const struct tracker_rig *rig,
		       const struct shot *shot, struct vec3 p_m)
{
	struct sight sights[CAMERA_MAX];
	uint32_t count = find_sights(check, rig, shot, p_m, sights);
	double n[3][3] = {{0}}, inverse[3][3], g[3] = {0}, step_m[3];

	for (uint32_t i = 0; i < count; i++)
		add_normal(&sights[i], n, g);
	if (count < 3 || !invert(n, inverse))
		return;
	for (int i = 0; i < 3; i++)
		step_m[i] = inverse[i][0] * g[0] + inverse[i][1] * g[1] + inverse[i][2] * g[2];
	for (uint32_t i = 0; i < count; i++)
		add_left(check, &sights[i], inverse, step_m);
}

/* How much of what is left over a shift of this camera explains, and the shift. */
static double explain(const struct aim_check *check, uint32_t camera, double *shift_px)
{
	const double(*f)[2] = check->cameras[camera].free;
	const double *left = check->cameras[camera].left_px;
	double determinant = f[0][0] * f[1][1] - f[0][1] * f[1][0];
	double least = FREE_MIN * check->cameras[camera].found;

	if (check->cameras[camera].found < FOUND_MIN || !(determinant > least * least))
		return 0;
	double x_px = (f[1][1] * left[0] - f[0][1] * left[1]) / determinant;
	double y_px = (f[0][0] * left[1] - f[1][0] * left[0]) / determinant;

	*shift_px = sqrt(x_px * x_px + y_px * y_px);
	return x_px * left[0] + y_px * left[1];
}

static void answer(struct aim_check *check, uint32_t camera_count)
{
	double most = 0, shift_px = 0;
	uint32_t best = 0;

	memset(check->shift_px, 0, sizeof(check->shift_px));
	for (uint32_t c = 0; c < camera_count; c++) {
		double own_px = 0, explained = explain(check, c, &own_px);

		if (explained <= most)
			continue;
		most = explained;
		shift_px = own_px;
		best = c;
	}
	check->shift_px[best] = shift_px;
	for (uint32_t c = 0; c < camera_count; c++)
		if (check->cameras[c].tried >= FOUND_MIN &&
		    check->cameras[c].found < FAR_SHARE * check->cameras[c].tried)
			check->shift_px[c] = AIM_FAR_PX;
	memset(check->cameras, 0, sizeof(check->cameras));
	check->shots = 0;
}

bool aim_check_run(struct aim_check *check, const struct tracker_rig *rig, const struct shot *shot,
		   const struct marker_set *set)
{
	for (int i = 0; set->label_count && i < LABELS_A_SHOT; i++) {
		uint32_t label = check->turn++ % set->label_count;

		if (set->markers[label].status == MARKER_MEASURED)
			add_marker(check, rig, shot, set->markers[label].p_stage_m);
	}
	if (++check->shots < AIM_CHECK_SHOTS)
		return false;
	answer(check, rig->camera_count);
	return true;
}
