/*
 * A ray o + a d meets the unit sphere where |d|^2 a^2 + 2 (o.d) a + |o|^2 - 1 = 0. Along a row both
 * d and the terms change by the column, and the row's two ends are where the root's square is 0.
 */
#include "sim/render/hd_solid.h"

#define PROBE_M 0.01
#define ASIDE_MAX 0.8 /* tangent from the axis; lenses lose their senses farther out */
#define REACH 1.15    /* of the bounding sphere in the picture, nearer parts included */

static int even_floor(double value, int limit)
{
	int whole = value < 0 ? 0 : value > limit ? limit : (int)value;

	return whole & ~1;
}

static void to_unit(const struct sim_truth_occluder *solid, struct vec3 v, double out[3])
{
	for (int k = 0; k < 3; k++)
		out[k] = solid->to_unit[k][0] * v.x + solid->to_unit[k][1] * v.y +
			 solid->to_unit[k][2] * v.z;
}

bool hd_sight_find(struct hd_sight *sight, const struct sim_camera *camera,
		   const struct sim_truth_occluder *solid)
{
	const double(*r)[3] = camera->rt_cam_stage.r;
	struct vec3 right = {r[0][0], r[0][1], r[0][2]}, down = {r[1][0], r[1][1], r[1][2]};
	struct vec3 middle = solid->centre_stage_m;
	struct vec3 p_cam = pose_apply(&camera->rt_cam_stage, middle);
	double at[2], beside[2], below[2];

	if (!(fabs(p_cam.x) < ASIDE_MAX * p_cam.z && fabs(p_cam.y) < ASIDE_MAX * p_cam.z))
		return false;
	if (!sim_camera_project(camera, middle, at) ||
	    !sim_camera_project(camera, vec3_add(middle, vec3_scale(right, PROBE_M)), beside) ||
	    !sim_camera_project(camera, vec3_add(middle, vec3_scale(down, PROBE_M)), below))
		return false;
	double a = beside[0] - at[0], b = below[0] - at[0], c = beside[1] - at[1],
	       d = below[1] - at[1];
	double scale = PROBE_M / (a * d - b * c), reach = REACH * solid->radius_m * a / PROBE_M;

	if (!(a > 0 && scale > 0))
		return false;
	to_unit(solid, vec3_sub(camera->centre_stage_m, middle), sight->camera);
	to_unit(solid, vec3_scale(vec3_sub(vec3_scale(right, d), vec3_scale(down, c)), scale),
		sight->right);
	to_unit(solid, vec3_scale(vec3_sub(vec3_scale(down, a), vec3_scale(right, b)), scale),
		sight->down);
	sight->middle_px[0] = at[0];
	sight->middle_px[1] = at[1];
	sight->box = (struct pixel_window){even_floor(at[0] - reach, camera->width_px),
					   even_floor(at[1] - reach, camera->height_px),
					   even_floor(at[0] + reach + 2, camera->width_px),
					   even_floor(at[1] + reach + 2, camera->height_px)};
	return pixel_window_count(&sight->box) > 0;
}

/* The rays of one pair of rows: ray[k] + x * right[k], x from the middle. */
struct rays {
	float camera[3], ray[3], right[3];
	float away2; /* |camera|^2 - 1 */
};

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The columns between which the rays of the row meet the sphere. */
static bool find_ends(const struct hd_sight *sight, double y_px, struct rays *rays, double ends[2])
{
	double ray[3], away2 = dot(sight->camera, sight->camera) - 1;

	for (int k = 0; k < 3; k++)
		ray[k] = y_px * sight->down[k] - sight->camera[k];
	double o_ray = dot(sight->camera, ray), o_right = dot(sight->camera, sight->right);
	double q2 = o_right * o_right - away2 * dot(sight->right, sight->right);
	double q1 = o_ray * o_right - away2 * dot(ray, sight->right);
	double q0 = o_ray * o_ray - away2 * dot(ray, ray);
	double root2 = q1 * q1 - q2 * q0;

	if (!(away2 > 0 && q2 < 0 && root2 > 0))
		return false;
	ends[0] = (-q1 + sqrt(root2)) / q2;
	ends[1] = (-q1 - sqrt(root2)) / q2;
	rays->away2 = (float)away2;
	for (int k = 0; k < 3; k++) {
		rays->camera[k] = (float)sight->camera[k];
		rays->ray[k] = (float)ray[k];
		rays->right[k] = (float)sight->right[k];
	}
	return true;
}

#define PIECE 256 /* cells at a time: plain arrays, for the compiler's vectors */

struct places {
	float x[PIECE], y[PIECE], z[PIECE];
};

static void meet(const struct rays *rays, float x0_px, int count, struct places *restrict out)
{
	const float *o = rays->camera, *r = rays->ray, *s = rays->right;

	for (int i = 0; i < count; i++) {
		float x = x0_px + 2 * (float)i;
		float u = r[0] + x * s[0], v = r[1] + x * s[1], w = r[2] + x * s[2];
		float a = u * u + v * v + w * w, b = u * o[0] + v * o[1] + w * o[2];
		float root2 = b * b - a * rays->away2; /* below 0 by rounding alone */
		float along = (-b - sqrtf(fabsf(root2))) / a;

		out->x[i] = o[0] + along * u;
		out->y[i] = o[1] + along * v;
		out->z[i] = o[2] + along * w;
	}
}

static inline void put_cell(const uint8_t texel[HD_COLOURS], const int8_t *grain, uint8_t *upper,
			    uint8_t *lower)
{
	upper[0] = (uint8_t)(texel[HD_RED] + grain[0]);
	upper[1] = (uint8_t)(texel[HD_GREEN] + grain[1]);
	lower[0] = (uint8_t)(texel[HD_GREEN] + grain[2]);
	lower[1] = (uint8_t)(texel[HD_BLUE] + grain[3]);
}

static void put_painted(const struct places *places, const struct hd_coat *coat, int count,
			const int8_t *grain, uint8_t *upper, uint8_t *lower)
{
	const struct hd_paint *paint = coat->paint;
	int at[PIECE];

	for (int i = 0; i < count; i++)
		at[i] = hd_texel_index(places->y[i], HD_PAINT_SIDE) * HD_PAINT_SIDE +
			hd_texel_index(places->x[i], HD_PAINT_SIDE);
	for (int i = 0; i < count; i++) {
		const uint8_t *texel = paint->face[0][0] + 4 * at[i];

		if (places->z[i] < 0)
			texel = hd_paint_behind(paint, places->x[i], places->y[i]);
		else if (texel[HD_COLOURS] != HD_STILL)
			texel = hd_paint_live(paint, &coat->mood, texel, places->x[i],
					      places->y[i]);
		put_cell(texel, &grain[4 * i], &upper[2 * i], &lower[2 * i]);
	}
}

/* Cloth and bare skin: lit from one side, with a weave. */
static void put_plain(const struct places *places, const struct hd_coat *coat, int count,
		      const int8_t *grain, uint8_t *upper, uint8_t *lower)
{
	const float *light = coat->light;
	int shades[PIECE];

	for (int i = 0; i < count; i++) {
		float lit =
			places->x[i] * light[0] + places->y[i] * light[1] + places->z[i] * light[2];
		int weave = (int)(places->x[i] * 90 + 1000) ^ (int)(places->y[i] * 90 + 1000);

		shades[i] = (int)(100 + 75 * (lit + fabsf(lit))) + 8 * (weave & 1);
	}
	for (int i = 0; i < count; i++) {
		uint8_t texel[HD_COLOURS];

		for (int k = 0; k < HD_COLOURS; k++)
			texel[k] = (uint8_t)(9 + (shades[i] * coat->colour[k] >> 8));
		put_cell(texel, &grain[4 * i], &upper[2 * i], &lower[2 * i]);
	}
}

static void draw_cells(const struct rays *rays, const struct hd_coat *coat, float x0_px, int count,
		       const struct hd_canvas *canvas, uint8_t *upper, uint8_t *lower)
{
	struct places places;

	for (int i = 0; i < count; i += PIECE) {
		const int8_t *grain =
			&canvas->grain[(canvas->grain_at + 4 * (uint32_t)i) % HD_GRAIN];
		int here = count - i < PIECE ? count - i : PIECE;

		meet(rays, x0_px + 2 * (float)i, here, &places);
		(coat->paint ? put_painted : put_plain)(&places, coat, here, grain, &upper[2 * i],
							&lower[2 * i]);
	}
}

static void widen(struct pixel_window *covered, int x0, int x1, int y)
{
	if (pixel_window_count(covered) == 0)
		*covered = (struct pixel_window){x0, y, x1, y + 2};
	covered->x0 = x0 < covered->x0 ? x0 : covered->x0;
	covered->x1 = x1 > covered->x1 ? x1 : covered->x1;
	covered->y1 = y + 2;
}

struct pixel_window hd_solid_draw(const struct hd_sight *sight, const struct hd_coat *coat, int y0,
				  int y1, struct hd_canvas *canvas)
{
	const struct pixel_window *box = &sight->box;
	struct pixel_window covered = {0};
	struct rays rays;
	double ends[2];

	for (int y = y0 > box->y0 ? y0 : box->y0; y < y1 && y < box->y1; y += 2) {
		canvas->grain_at += 4 * 1021;
		if (!find_ends(sight, y + 0.5 - sight->middle_px[1], &rays, ends))
			continue;
		int x0 = even_floor(sight->middle_px[0] + ends[0] + 1, box->x1);
		int x1 = even_floor(sight->middle_px[0] + ends[1] + 1, box->x1);

		x0 = x0 < box->x0 ? box->x0 : x0;
		if (x1 <= x0)
			continue;
		uint8_t *row = canvas->image + (size_t)y * (size_t)canvas->width_px + x0;

		draw_cells(&rays, coat, (float)(x0 + 0.5 - sight->middle_px[0]), (x1 - x0) / 2,
			   canvas, row, row + canvas->width_px);
		widen(&covered, x0, x1, y);
	}
	return covered;
}
