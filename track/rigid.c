/*
 * Horn's closed-form absolute orientation.
 */
#include "track/rigid.h"

#include <errno.h>
#include <stdbool.h>
#include <string.h>

#define SWEEP_MAX 12

/* One Jacobi rotation that zeroes a[p][q] of a symmetric 4x4; v collects the eigenvectors. */
static void jacobi_rotate(double a[4][4], double v[4][4], int p, int q)
{
	if (fabs(a[p][q]) < 1e-300)
		return;
	double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
	double t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
	double c = 1 / sqrt(t * t + 1), s = t * c;

	for (int k = 0; k < 4; k++) {
		double kp = a[k][p], kq = a[k][q];
		a[k][p] = c * kp - s * kq;
		a[k][q] = s * kp + c * kq;
	}
	for (int k = 0; k < 4; k++) {
		double pk = a[p][k], qk = a[q][k];
		a[p][k] = c * pk - s * qk;
		a[q][k] = s * pk + c * qk;
	}
	for (int k = 0; k < 4; k++) {
		double kp = v[k][p], kq = v[k][q];
		v[k][p] = c * kp - s * kq;
		v[k][q] = s * kp + c * kq;
	}
}

static bool is_diagonal(double a[4][4])
{
	double off = 0, on = 0;

	for (int p = 0; p < 4; p++) {
		on += fabs(a[p][p]);
		for (int q = p + 1; q < 4; q++)
			off += fabs(a[p][q]);
	}
	return off <= 1e-15 * on;
}

/* Eigenvector of the largest eigenvalue; false when the next one is as large (no unique pose). */
static bool largest_eigenvector(double a[4][4], double q[4])
{
	double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
	int best = 0;
	double second = -INFINITY;

	for (int sweep = 0; sweep < SWEEP_MAX && !is_diagonal(a); sweep++)
		for (int p = 0; p < 3; p++)
			for (int r = p + 1; r < 4; r++)
				jacobi_rotate(a, v, p, r);
	for (int k = 1; k < 4; k++)
		if (a[k][k] > a[best][best])
			best = k;
	for (int k = 0; k < 4; k++) {
		q[k] = v[k][best];
		if (k != best && a[k][k] > second)
			second = a[k][k];
	}
	return a[best][best] - second > 1e-9 * fabs(a[best][best]);
}

static void rotation_from_quaternion(const double q[4], struct pose *pose)
{
	double w = q[0], x = q[1], y = q[2], z = q[3];

	*pose = (struct pose){
		.r = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
		      {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
		      {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

static void cross_covariance(const struct rigid_pair *pairs, int count, struct vec3 from_mean,
			     struct vec3 to_mean, double s[3][3])
{
	memset(s, 0, 9 * sizeof(s[0][0]));
	for (int i = 0; i < count; i++) {
		struct vec3 f = vec3_sub(pairs[i].from, from_mean),
			    t = vec3_sub(pairs[i].to, to_mean);
		double from[3] = {f.x, f.y, f.z}, to[3] = {t.x, t.y, t.z};

		for (int r = 0; r < 3; r++)
			for (int c = 0; c < 3; c++)
				s[r][c] += pairs[i].weight * from[r] * to[c];
	}
}

int rigid_fit(const struct rigid_pair *pairs, int count, struct pose *rt_to_from)
{
	struct vec3 from_mean = {0, 0, 0}, to_mean = {0, 0, 0};
	double weight = 0, s[3][3], q[4];

	for (int i = 0; i < count; i++) {
		from_mean = vec3_add(from_mean, vec3_scale(pairs[i].from, pairs[i].weight));
		to_mean = vec3_add(to_mean, vec3_scale(pairs[i].to, pairs[i].weight));
		weight += pairs[i].weight;
	}
	if (count < 3 || !(weight > 0))
		return -EDOM;
	from_mean = vec3_scale(from_mean, 1 / weight);
	to_mean = vec3_scale(to_mean, 1 / weight);
	cross_covariance(pairs, count, from_mean, to_mean, s);

	double n[4][4] = {{s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2],
			   s[0][1] - s[1][0]},
			  {s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0],
			   s[2][0] + s[0][2]},
			  {s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2],
			   s[1][2] + s[2][1]},
			  {s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1],
			   s[2][2] - s[0][0] - s[1][1]}};

	if (!largest_eigenvector(n, q))
		return -EDOM;
	rotation_from_quaternion(q, rt_to_from);
	rt_to_from->t = vec3_sub(to_mean, pose_rotate(rt_to_from, from_mean));
	return 0;
}
