/*
 * Per marker one step of least squares over all its views; what it leaves over, and how much of a
 * turn it would have left over, are summed per camera. A spot that the tracker left out is likely
 * another marker's, unless it leaves out many of that camera. Turns about the line of sight move
 * pictures little, and no more than noise where all markers are in the middle: they are held back.
 */
#include "track/aim_check.h"

#include <string.h>

#define LABELS_A_SHOT 6
#define FOUND_MIN 100     /* views of a camera, until it has an answer */
#define FAR_MIN 300       /* markers that it should have found, until it is called far off */
#define FAR_SHARE 0.08    /* a camera that finds fewer of its markers is far off */
#define FAR_BLOBS 16      /* though it sees as many spots */
#define TAKEN_SHARE 0.5   /* of its spots: a camera with fewer is doubted */
#define FREE_MIN 0.02     /* of a turn: less tells nothing */
#define ROLL_MIN 2e-4     /* of what a turn across moves: a roll that moves less tells nothing */
#define RIG_SIGMA_PX 0.05 /* spots are not trusted more than the calibration */

/* One camera's view of a marker. */
struct sight {
	uint32_t camera;
	double weight;
	double e_px[2];    /* spot - projection */
	double j[2][3];    /* of the projection by the point, px/m */
	double turn[2][3]; /* of the projection by the camera's turn, px/rad */
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

static void fill_sight(struct sight *sight, uint32_t camera, const struct blob *blob,
		       const double pixel[2])
{
	double sigma_px = blob->sigma_px;

	sight->camera = camera;
	sight->weight = 1 / (sigma_px * sigma_px + RIG_SIGMA_PX * RIG_SIGMA_PX);
	sight->e_px[0] = blob->x_px - pixel[0];
	sight->e_px[1] = blob->y_px - pixel[1];
}

static uint32_t find_sights(struct aim_sums *sums, const struct tracker_rig *rig,
			    const struct shot *shot, struct vec3 p_m, uint32_t taken_mask,
			    uint32_t doubted_mask, struct sight *sights)
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
		sums[c].tried++;
		if (!blob || blob->flags)
			continue;
		sums[c].found++;
		sums[c].taken += taken_mask >> c & 1;
		if (!((taken_mask | doubted_mask) >> c & 1))
			continue;
		fill_sight(sight, c, blob, pixel);
		for (int row = 0; row < 2; row++)
			view_turn(rig->views[c], p_m, sight->j[row], sight->turn[row]);
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

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void apply(double m[3][3], const double v[3], double out[3])
{
	for (int i = 0; i < 3; i++)
		out[i] = dot(m[i], v);
}

/* Adds weight * a b'. */
static void add_product(double m[3][3], const double a[3], const double b[3], double weight)
{
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			m[i][k] += weight * a[i] * b[k];
}

/* What is left over of the view once the point has made its step, and what would be of a turn. */
static void add_left(struct aim_sums *sums, const struct sight *sight, double inverse[3][3],
		     const double step_m[3])
{
	for (int row = 0; row < 2; row++) {
		double left_px = sight->e_px[row] - dot(sight->j[row], step_m), taken[3];

		apply(inverse, sight->j[row], taken);
		for (int i = 0; i < 3; i++)
			sums->left[i] += sight->weight * sight->turn[row][i] * left_px;
		add_product(sums->reach, sight->turn[row], sight->turn[row], sight->weight);
		for (int other = 0; other < 2; other++)
			add_product(sums->normal, sight->turn[row], sight->turn[other],
				    sight->weight * ((row == other) -
						     sight->weight * dot(taken, sight->j[other])));
	}
	sums->weight += sight->weight;
}

static void add_marker(struct aim_sums *sums, const struct tracker_rig *rig,
		       const struct shot *shot, const struct marker *marker, uint32_t doubted_mask)
{
	struct sight sights[CAMERA_MAX];
	uint32_t count = find_sights(sums, rig, shot, marker->p_stage_m, marker->camera_mask,
				     doubted_mask, sights);
	double n[3][3] = {{0}}, inverse[3][3], g[3] = {0}, step_m[3];

	for (uint32_t s = 0; s < count; s++)
		for (int row = 0; row < 2; row++) {
			const struct sight *sight = &sights[s];

			add_product(n, sight->j[row], sight->j[row], sight->weight);
			for (int i = 0; i < 3; i++)
				g[i] += sight->weight * sight->j[row][i] * sight->e_px[row];
		}
	if (count < 3 || !invert(n, inverse))
		return;
	apply(inverse, g, step_m);
	for (uint32_t s = 0; s < count; s++)
		add_left(&sums[sights[s].camera], &sights[s], inverse, step_m);
}

static void add_block(struct aim_sums *sum, const struct aim_sums *block)
{
	for (int i = 0; i < 3; i++) {
		sum->left[i] += block->left[i];
		for (int k = 0; k < 3; k++) {
			sum->normal[i][k] += block->normal[i][k];
			sum->reach[i][k] += block->reach[i][k];
		}
	}
	sum->weight += block->weight;
	sum->tried += block->tried;
	sum->found += block->found;
	sum->taken += block->taken;
}

/* How much of what is left over a turn of this camera explains, and the turn. */
static double explain(const struct aim_sums *sums, struct aim *aim)
{
	double n[3][3], inverse[3][3], turn_rad[3], moved[3], reach[3][3];
	double trace = sums->reach[0][0] + sums->reach[1][1] + sums->reach[2][2];

	memcpy(reach, sums->reach, sizeof(reach));
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			n[i][k] = sums->normal[i][k] + FREE_MIN * reach[i][k] +
				  (i == k) * ROLL_MIN * trace;
	if (sums->found < FOUND_MIN || !invert(n, inverse))
		return 0;
	apply(inverse, sums->left, turn_rad);
	apply(reach, turn_rad, moved);
	aim->shift_px = sqrt(dot(turn_rad, moved) / sums->weight);
	aim->turn_mrad = 1e3 * sqrt(dot(turn_rad, turn_rad));
	return dot(turn_rad, sums->left);
}

static void answer(struct aim_check *check, uint32_t camera_count)
{
	struct aim best = {0};
	uint32_t best_camera = 0;
	double most = 0;

	memset(check->aims, 0, sizeof(check->aims));
	check->doubted_mask = 0;
	for (uint32_t c = 0; c < camera_count; c++) {
		struct aim_sums sums = {0};
		struct aim aim = {0};

		for (int b = 0; b < AIM_BLOCKS; b++)
			add_block(&sums, &check->cameras[b][c]);
		double explained = explain(&sums, &aim);
		if (explained > most) {
			most = explained;
			best = aim;
			best_camera = c;
		}
		if (sums.taken < TAKEN_SHARE * sums.found)
			check->doubted_mask |= UINT32_C(1) << c;
		if (sums.tried >= FAR_MIN && sums.found < FAR_SHARE * sums.tried)
			check->aims[c].shift_px = AIM_FAR_PX;
	}
	if (check->aims[best_camera].shift_px < AIM_FAR_PX)
		check->aims[best_camera] = best;
}

bool aim_check_run(struct aim_check *check, const struct tracker_rig *rig, const struct shot *shot,
		   const struct marker_set *set)
{
	for (int i = 0; set->label_count && i < LABELS_A_SHOT; i++) {
		uint32_t label = check->turn++ % set->label_count;

		if (set->markers[label].status == MARKER_MEASURED)
			add_marker(check->cameras[check->block], rig, shot, &set->markers[label],
				   check->doubted_mask);
	}
	int64_t lasts_ns = shot->mid_exposure_ns - check->block_began_ns;

	if (lasts_ns >= 0 && lasts_ns < AIM_BLOCK_NS)
		return false;
	check->block_began_ns = shot->mid_exposure_ns;
	answer(check, rig->camera_count);
	check->block = (check->block + 1) % AIM_BLOCKS;
	memset(check->cameras[check->block], 0, sizeof(check->cameras[check->block]));
	return true;
}
