/*
 * Focal length and poses from homographies.
 */
#include "calib/board/plane_pose.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>

#include "calib/board/homography.h"
#include "calib/solve/small_solve.h"

#define ROUNDS 15
#define Z_MIN 1e-6
#define TILT_MIN 1e-4      /* mean of a^2: about 8 degrees in every view */
#define FOCAL_PART_MIN 0.2 /* of the half width */
#define FOCAL_PART_MAX 40

void focal_add(struct focal_sums *sums, const double h[9], double half_width_px)
{
	double n[9], norm = 0;

	for (int i = 0; i < 9; i++) {
		n[i] = i < 6 ? h[i] / half_width_px : h[i];
		norm += i % 3 < 2 ? n[i] * n[i] : 0; /* of the columns that are directions */
	}
	double x = (n[0] * n[0] + n[3] * n[3]) / norm, x0 = n[6] * n[6] / norm;
	double y = (n[1] * n[1] + n[4] * n[4]) / norm, y0 = n[7] * n[7] / norm;
	double a[2] = {(n[0] * n[1] + n[3] * n[4]) / norm, (x - y) / 2};
	double b[2] = {n[6] * n[7] / norm, (x0 - y0) / 2};

	for (int i = 0; i < 2; i++) {
		sums->product[i] += a[i] * b[i];
		sums->square[i] += a[i] * a[i];
	}
	double high[3] = {x0 * y0, x * y0 + x0 * y, x * y}, wide[3] = {x0 * x0, 2 * x * x0, x * x};
	for (int i = 0; i < 3; i++) {
		sums->high[i] += high[i];
		sums->wide[i] += wide[i];
	}
	sums->view_count++;
}

int focal_from_sums(const struct focal_sums *sums, double half_width_px, double *focal_px)
{
	double square = sums->square[0] + sums->square[1];
	double product = sums->product[0] + sums->product[1];

	if (!(square > TILT_MIN * sums->view_count) || product >= 0)
		return -EDOM;
	double part = sqrt(-square / product);
	if (part < FOCAL_PART_MIN || part > FOCAL_PART_MAX)
		return -EDOM;
	*focal_px = part * half_width_px;
	return 0;
}

double focal_aspect(const struct focal_sums *sums)
{
	double w = -sums->product[0] / sums->square[0]; /* right angles do not depend on it */
	double high = sums->high[0] + w * (sums->high[1] + w * sums->high[2]);
	double wide = sums->wide[0] + w * (sums->wide[1] + w * sums->wide[2]);

	if (!(sums->square[0] > TILT_MIN * sums->view_count) || !(high > 0) || !(wide > 0))
		return 1;
	return sqrt(high / wide);
}

/* Gauss-Newton follows, so Gram-Schmidt is rotation enough. */
static int pose_from_homography(struct pose *pose, const double h[9], double focal_px)
{
	struct vec3 x = {h[0] / focal_px, h[3] / focal_px, h[6]};
	struct vec3 y = {h[1] / focal_px, h[4] / focal_px, h[7]};
	struct vec3 t = {h[2] / focal_px, h[5] / focal_px, h[8]};
	double scale = (t.z < 0 ? -2 : 2) / (vec3_norm(x) + vec3_norm(y));

	x = vec3_unit(vec3_scale(x, scale));
	y = vec3_scale(y, scale);
	y = vec3_unit(vec3_sub(y, vec3_scale(x, vec3_dot(x, y))));
	struct vec3 z = vec3_cross(x, y);
	*pose = (struct pose){.r = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}},
			      .t = vec3_scale(t, scale)};
	return isfinite(x.x + y.x + pose->t.x + pose->t.z) ? 0 : -EDOM;
}

/* The other pose that a far plane might have: its normal mirrored at the line of sight. */
static struct pose mirrored(const struct pose *pose)
{
	struct vec3 sight = vec3_unit(pose->t);
	struct vec3 normal = {pose->r[0][2], pose->r[1][2], pose->r[2][2]};
	struct vec3 axis = vec3_cross(normal, sight);
	double sine = vec3_norm(axis), angle = atan2(sine, vec3_dot(normal, sight));
	struct vec3 turn_by =
		sine > 1e-9 ? vec3_scale(axis, 2 * angle / sine) : (struct vec3){0, 0, 0};
	struct pose turn = pose_from_rotation_vector(turn_by);
	struct pose other = pose_compose(&turn, pose);

	other.t = pose->t;
	return other;
}

/* Adds one corner to the normal equations of a left-multiplied small motion; its squared error. */
static double add_corner(double a[36], double b[6], struct vec3 p, struct vec3 turned,
			 const double px[2], double f)
{
	double u = p.x / p.z, v = p.y / p.z;
	double ex = px[0] - f * u, ey = px[1] - f * v;
	double g = f / p.z;
	/* dq/dp = g [1 0 -u; 0 1 -v]; dp/dw = -[turned]x, dp/dt = 1 */
	double row_x[6] = {
		-g * u * turned.y, g * (turned.z + u * turned.x), -g * turned.y, g, 0, -g * u};
	double row_y[6] = {
		-g * (turned.z + v * turned.y), g * v * turned.x, g * turned.x, 0, g, -g * v};

	small_solve_add(6, a, b, row_x, ex, 1);
	small_solve_add(6, a, b, row_y, ey, 1);
	return ex * ex + ey * ey;
}

/* One step; returns the sum of squares before it, or -1 when there is none. */
static double step(struct pose *pose, const double (*board_m)[2], const double (*px)[2],
		   uint32_t count, double focal_px)
{
	double a[36] = {0}, b[6] = {0}, sum = 0;

	for (uint32_t i = 0; i < count; i++) {
		if (isnan(px[i][0] + px[i][1]))
			continue;
		struct vec3 turned =
			pose_rotate(pose, (struct vec3){board_m[i][0], board_m[i][1], 0});
		struct vec3 p = vec3_add(turned, pose->t);
		if (p.z < Z_MIN)
			return -1;
		sum += add_corner(a, b, p, turned, px[i], focal_px);
	}
	if (small_solve(6, a, b))
		return -1;
	struct pose turn = pose_from_rotation_vector((struct vec3){b[0], b[1], b[2]});
	struct vec3 t = vec3_add(pose->t, (struct vec3){b[3], b[4], b[5]});
	*pose = pose_compose(&turn, pose);
	pose->t = t;
	return sum;
}

/* Returns the sum of squares, or infinity. */
static double refine(struct pose *pose, const double (*board_m)[2], const double (*px)[2],
		     uint32_t count, double focal_px)
{
	double sum = INFINITY;

	for (int round = 0; round < ROUNDS; round++) {
		struct pose before = *pose;
		double now = step(pose, board_m, px, count, focal_px);

		if (now < 0 || !isfinite(now) || (round > 4 && now > sum)) {
			*pose = before;
			return now < 0 || !isfinite(now) ? INFINITY : now;
		}
		bool still = now > sum * (1 - 1e-9) && round > 1;
		sum = now;
		if (still)
			break;
	}
	return sum;
}

int plane_pose_fit(struct pose *rt_cam_board, double *rms_px, const double (*board_m)[2],
		   const double (*px)[2], uint32_t count, double focal_px)
{
	struct pose poses[2];
	double h[9], sums[2];
	uint32_t seen = 0;

	if (homography_fit(h, board_m, px, count) || pose_from_homography(&poses[0], h, focal_px))
		return -EDOM;
	sums[0] = refine(&poses[0], board_m, px, count, focal_px);
	poses[1] = mirrored(&poses[0]);
	sums[1] = refine(&poses[1], board_m, px, count, focal_px);
	int best = sums[1] < sums[0];
	if (!isfinite(sums[best]))
		return -EDOM;
	for (uint32_t i = 0; i < count; i++)
		seen += !isnan(px[i][0] + px[i][1]);
	*rt_cam_board = poses[best];
	*rms_px = sqrt(sums[best] / seen);
	return 0;
}
