/*
 * Conversions of a rotation matrix that are too long to inline.
 */
#include "base/geometry.h"

void pose_to_quaternion(const struct pose *p, double q_wxyz[4])
{
	double trace = p->r[0][0] + p->r[1][1] + p->r[2][2];
	double squares[4] = {1 + trace, 1 - trace + 2 * p->r[0][0], 1 - trace + 2 * p->r[1][1],
			     1 - trace + 2 * p->r[2][2]};
	/* products[i][j] = 4 q_i q_j: start from the largest square, which never vanishes */
	double wx = p->r[2][1] - p->r[1][2], wy = p->r[0][2] - p->r[2][0],
	       wz = p->r[1][0] - p->r[0][1], xy = p->r[1][0] + p->r[0][1],
	       xz = p->r[0][2] + p->r[2][0], yz = p->r[2][1] + p->r[1][2];
	double products[4][4] = {{squares[0], wx, wy, wz},
				 {wx, squares[1], xy, xz},
				 {wy, xy, squares[2], yz},
				 {wz, xz, yz, squares[3]}};
	int best = 0;

	for (int i = 1; i < 4; i++)
		if (squares[i] > squares[best])
			best = i;
	double scale = 0.5 / sqrt(squares[best]);
	if (products[best][0] < 0)
		scale = -scale;
	for (int i = 0; i < 4; i++)
		q_wxyz[i] = products[best][i] * scale;
}

struct vec3 pose_to_rotation_vector(const struct pose *p)
{
	double q[4];

	pose_to_quaternion(p, q);
	struct vec3 axis = {q[1], q[2], q[3]};
	double sine = vec3_norm(axis);
	double factor = sine > 1e-12 ? 2.0 * atan2(sine, q[0]) / sine : 2.0;

	return vec3_scale(axis, factor);
}
