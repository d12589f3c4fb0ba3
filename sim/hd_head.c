/*
 * The ellipsoid's picture is an ellipse. Each of its pixels is a point of the unit sphere by a
 * linear map, and that point is a place in the painted texture. Four pixels, one of the Bayer
 * pattern's cells, share a point.
 */
#include "sim/hd_head.h"

#include <math.h>
#include <string.h>

/* An ellipse painted on the front of the unit sphere. */
struct patch {
	double x, y, half_width, half_height;
	uint8_t colour[HD_COLOURS];
};

/* Dark: the lens is stopped down so that the markers, added on top, stay below white. */
static const uint8_t SKIN[HD_COLOURS] = {71, 53, 44}, HAIR[HD_COLOURS] = {26, 20, 16};

static const struct patch PATCHES[] = {
	{0.36, 0.14, 0.17, 0.075, {73, 72, 69}},    {-0.36, 0.14, 0.17, 0.075, {73, 72, 69}},
	{0.36, 0.14, 0.065, 0.07, {27, 35, 31}},    {-0.36, 0.14, 0.065, 0.07, {27, 35, 31}},
	{0.38, 0.33, 0.23, 0.035, {31, 23, 19}},    {-0.38, 0.33, 0.23, 0.035, {31, 23, 19}},
	{0.0, -0.14, 0.14, 0.1, {63, 45, 37}},      {0.07, -0.19, 0.035, 0.025, {30, 20, 18}},
	{-0.07, -0.19, 0.035, 0.025, {30, 20, 18}}, {0.0, -0.48, 0.3, 0.075, {71, 35, 34}},
	{0.0, -0.48, 0.26, 0.012, {34, 16, 16}},
};

static void paint(double x, double y, bool front, uint8_t colour[HD_COLOURS])
{
	double hairline = 0.66 - 0.25 * x * x;
	bool hair = !front || y > hairline || (fabs(x) > 0.93 && y > -0.2);

	memcpy(colour, hair ? HAIR : SKIN, HD_COLOURS);
	for (size_t i = 0; !hair && i < sizeof(PATCHES) / sizeof(PATCHES[0]); i++) {
		const struct patch *p = &PATCHES[i];
		double u = (x - p->x) / p->half_width, v = (y - p->y) / p->half_height;

		double share = fmin(fmax(2 * (1 - sqrt(u * u + v * v)), 0), 1); /* soft rim */

		for (int k = 0; k < HD_COLOURS; k++)
			colour[k] = (uint8_t)(colour[k] + share * (p->colour[k] - colour[k]));
	}
}

void hd_head_init(struct hd_head *head)
{
	const struct vec3 light = vec3_unit((struct vec3){0.25, 0.45, 0.85});

	memset(head, 0, sizeof(*head));
	for (int back = 0; back < 2; back++)
		for (int row = 0; row < HD_HEAD_SIDE; row++)
			for (int column = 0; column < HD_HEAD_SIDE; column++) {
				uint8_t *texel = head->texels[back][row][column];
				double x = (column + 0.5) * 2 / HD_HEAD_SIDE - 1;
				double y = (row + 0.5) * 2 / HD_HEAD_SIDE - 1;
				double depth = sqrt(fmax(0, 1 - x * x - y * y));
				struct vec3 normal = {x, y, back ? -depth : depth};
				double shade = 0.45 + 0.55 * fmax(0, vec3_dot(normal, light));

				paint(x, y, !back, texel);
				for (int k = 0; k < HD_COLOURS; k++)
					texel[k] = (uint8_t)(shade * texel[k]);
			}
}

static int even_floor(double value, int limit)
{
	int whole = value < 0 ? 0 : value > limit ? limit : (int)value;

	return whole & ~1;
}

/* Where the ends of the ellipsoid's axes fall, from its middle: the columns of `to_px`. */
static bool find_axes(const struct sim_scene *scene, const struct sim_camera *camera,
		      const struct pose *rt_stage_head, double middle_px[2], double to_px[2][3])
{
	const double *axes_m = (const double *)&scene->actors[0].face.skull.axes_m;

	if (!sim_camera_project(camera, rt_stage_head->t, middle_px))
		return false;
	for (int k = 0; k < 3; k++) {
		double end[3] = {0, 0, 0}, ahead[2], behind[2];

		end[k] = axes_m[k];
		struct vec3 offset =
			pose_rotate(rt_stage_head, (struct vec3){end[0], end[1], end[2]});
		if (!sim_camera_project(camera, vec3_add(rt_stage_head->t, offset), ahead) ||
		    !sim_camera_project(camera, vec3_sub(rt_stage_head->t, offset), behind))
			return false;
		for (int i = 0; i < 2; i++)
			to_px[i][k] = 0.5 * (ahead[i] - behind[i]);
	}
	return true;
}

bool hd_sight_find(struct hd_sight *sight, const struct sim_scene *scene, uint32_t c,
		   const struct pose *rt_stage_head)
{
	const struct sim_camera *camera = &scene->cameras[c];
	double m[2][3];

	if (!find_axes(scene, camera, rt_stage_head, sight->middle_px, m))
		return false;
	struct vec3 across = {m[0][0], m[0][1], m[0][2]}, down = {m[1][0], m[1][1], m[1][2]};
	double aa = vec3_dot(across, across), ab = vec3_dot(across, down),
	       bb = vec3_dot(down, down);
	double determinant = aa * bb - ab * ab;

	if (!(determinant > 1))
		return false;
	for (int k = 0; k < 3; k++) { /* pseudo-inverse */
		sight->from_px[k][0] = (m[0][k] * bb - m[1][k] * ab) / determinant;
		sight->from_px[k][1] = (m[1][k] * aa - m[0][k] * ab) / determinant;
	}
	/* right x down points away from the camera */
	struct vec3 towards = vec3_scale(vec3_unit(vec3_cross(across, down)), -1);

	memcpy(sight->towards, &towards, sizeof(sight->towards));
	double reach_x = sqrt(aa), reach_y = sqrt(bb);
	const double *middle = sight->middle_px;

	sight->box = (struct pixel_window){even_floor(middle[0] - reach_x, camera->width_px),
					   even_floor(middle[1] - reach_y, camera->height_px),
					   even_floor(middle[0] + reach_x + 2, camera->width_px),
					   even_floor(middle[1] + reach_y + 2, camera->height_px)};
	return pixel_window_count(&sight->box) > 0;
}

static int texel_index(float s)
{
	int index = (int)((s + 1) * (0.5f * HD_HEAD_SIDE));

	return index < 0 ? 0 : index > HD_HEAD_SIDE - 1 ? HD_HEAD_SIDE - 1 : index;
}

/* The part of a pair of rows whose cells lie within the ellipse. */
static void draw_cells(const struct hd_head *head, const float from[3][2], const float towards[3],
		       const float offset_px[2], int cell_count, const int8_t *grain,
		       uint32_t grain_at, uint8_t *upper, uint8_t *lower)
{
	for (int i = 0; i < cell_count; i++) {
		float x = offset_px[0] + 2 * (float)i, s[3], flat2 = 0;

		for (int k = 0; k < 3; k++) {
			s[k] = from[k][0] * x + from[k][1] * offset_px[1];
			flat2 += s[k] * s[k];
		}
		if (flat2 >= 1)
			continue;
		float depth = sqrtf(1 - flat2);
		for (int k = 0; k < 3; k++)
			s[k] += towards[k] * depth;
		const uint8_t *texel = head->texels[s[2] < 0][texel_index(s[1])][texel_index(s[0])];
		const int8_t *g = &grain[(grain_at + 4 * (uint32_t)i) % HD_GRAIN];

		upper[2 * i] = (uint8_t)(texel[HD_RED] + g[0]);
		upper[2 * i + 1] = (uint8_t)(texel[HD_GREEN] + g[1]);
		lower[2 * i] = (uint8_t)(texel[HD_GREEN] + g[2]);
		lower[2 * i + 1] = (uint8_t)(texel[HD_BLUE] + g[3]);
	}
}

void hd_head_draw(const struct hd_head *head, const struct hd_sight *sight, const int8_t *grain,
		  uint32_t grain_start, uint8_t *image, int width_px)
{
	const struct pixel_window *box = &sight->box;
	float from[3][2], towards[3];
	uint32_t grain_at = grain_start & ~3u;

	for (int k = 0; k < 3; k++) {
		from[k][0] = (float)sight->from_px[k][0];
		from[k][1] = (float)sight->from_px[k][1];
		towards[k] = (float)sight->towards[k];
	}
	for (int y = box->y0; y < box->y1; y += 2, grain_at += 4 * 1021) {
		uint8_t *row = image + (size_t)y * (size_t)width_px + box->x0;
		float offset_px[2] = {(float)(box->x0 + 0.5 - sight->middle_px[0]),
				      (float)(y + 0.5 - sight->middle_px[1])};

		draw_cells(head, from, towards, offset_px, (box->x1 - box->x0) / 2, grain, grain_at,
			   row, row + width_px);
	}
}
