/*
 * Small vector and pose maths, inline. Metres, radians, right-handed.
 * A pose `rt_a_b` takes coordinates in b to coordinates in a: p_a = R p_b + t; names chain as
 * rt_a_c = pose_compose(rt_a_b, rt_b_c), so that neighbours cancel.
 */
#pragma once

#include <math.h>

struct vec3 {
	double x, y, z;
};

struct pose {
	double r[3][3];
	struct vec3 t;
};

#define POSE_IDENTITY ((struct pose){.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}})

static inline struct vec3 vec3_add(struct vec3 a, struct vec3 b)
{
	return (struct vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline struct vec3 vec3_sub(struct vec3 a, struct vec3 b)
{
	return (struct vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline struct vec3 vec3_scale(struct vec3 a, double s)
{
	return (struct vec3){a.x * s, a.y * s, a.z * s};
}

static inline double vec3_dot(struct vec3 a, struct vec3 b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct vec3 vec3_cross(struct vec3 a, struct vec3 b)
{
	return (struct vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline double vec3_norm(struct vec3 a)
{
	return sqrt(vec3_dot(a, a));
}

static inline double vec3_distance(struct vec3 a, struct vec3 b)
{
	return vec3_norm(vec3_sub(a, b));
}

/* A zero vector stays zero. */
static inline struct vec3 vec3_unit(struct vec3 a)
{
	double norm = vec3_norm(a);

	return norm > 0 ? vec3_scale(a, 1.0 / norm) : a;
}

static inline struct vec3 pose_rotate(const struct pose *p, struct vec3 v)
{
	return (struct vec3){p->r[0][0] * v.x + p->r[0][1] * v.y + p->r[0][2] * v.z,
			     p->r[1][0] * v.x + p->r[1][1] * v.y + p->r[1][2] * v.z,
			     p->r[2][0] * v.x + p->r[2][1] * v.y + p->r[2][2] * v.z};
}

static inline struct vec3 pose_apply(const struct pose *p, struct vec3 v)
{
	return vec3_add(pose_rotate(p, v), p->t);
}

static inline struct pose pose_compose(const struct pose *ab, const struct pose *bc)
{
	struct pose ac;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			ac.r[i][j] = ab->r[i][0] * bc->r[0][j] + ab->r[i][1] * bc->r[1][j] +
				     ab->r[i][2] * bc->r[2][j];
	ac.t = pose_apply(ab, bc->t);
	return ac;
}

static inline struct pose pose_inverse(const struct pose *p)
{
	struct pose inv;

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			inv.r[i][j] = p->r[j][i];
	inv.t = (struct vec3){0, 0, 0};
	inv.t = vec3_scale(pose_rotate(&inv, p->t), -1.0);
	return inv;
}

/* Rotation by the vector `w` (axis times angle, Rodrigues); translation zero. */
static inline struct pose pose_from_rotation_vector(struct vec3 w)
{
	double angle = vec3_norm(w);
	double a = angle > 1e-8 ? sin(angle) / angle : 1.0 - angle * angle / 6.0;
	double b = angle > 1e-8 ? (1.0 - cos(angle)) / (angle * angle) : 0.5;
	double c = cos(angle);

	return (struct pose){
		.r = {{c + b * w.x * w.x, b * w.x * w.y - a * w.z, b * w.x * w.z + a * w.y},
		      {b * w.x * w.y + a * w.z, c + b * w.y * w.y, b * w.y * w.z - a * w.x},
		      {b * w.x * w.z - a * w.y, b * w.y * w.z + a * w.x, c + b * w.z * w.z}}};
}

/* Unit quaternion [w, x, y, z] of the rotation, w >= 0 (Shepperd's method). */
void pose_to_quaternion(const struct pose *p, double q_wxyz[4]);

/* Rotation vector of the rotation, angle in [0, pi]. */
struct vec3 pose_to_rotation_vector(const struct pose *p);
