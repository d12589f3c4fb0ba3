/*
 * Areas alone would do, were it not for blur, which makes a marker of two pixels seem one of three.
 */
#include "track/match/point_size.h"

#define DISC 16.0        /* a disc's diameter squared over its spread */
#define OBLIQUE 0.85     /* of that is left on average: discs are hardly ever seen squarely */
#define MODEL_SHARE 0.1  /* of a spread: spots are neither Gaussians nor discs, and tilt */
#define GRID_PX2 0.1     /* pixels are whole, and blur is not the same everywhere */
#define CLASS_RATIO2 4.0 /* twice the diameter is another class */
#define CLASS_SIGMA 3.0
#define POINTS_A_SHOT 8
#define BLUR_GAIN 0.01
#define BLUR_STEP_MAX_PX2 1.0
#define BLUR_SIGHTS_MIN 100 /* before that a camera's blur is not known */

/* Square metres of the disc's spread per square pixel of its image; 0: the view tells nothing. */
static double scale_m2_px2(const struct matcher *m, const struct point *point, uint32_t c)
{
	const struct sight_index *camera = &m->cameras[c];
	const struct blob *blob = &camera->blobs[point->blob[c]];
	struct vec3 away_m = vec3_sub(point->fix.p_stage_m, camera->view->centre_stage_m);

	if (blob->flags || !(blob->shape_px2[0] > 0))
		return 0;
	return vec3_dot(away_m, away_m) / (camera->pixels_per_radian * camera->pixels_per_radian);
}

static double spread_px2(const struct matcher *m, const struct point *point, uint32_t c)
{
	const struct blob *blob = &m->cameras[c].blobs[point->blob[c]];

	return 0.5 * (double)(blob->shape_px2[0] + blob->shape_px2[2]);
}

struct point_size point_size(const struct matcher *m, const struct view_blur *blur,
			     const struct point *point)
{
	double sum = 0, error = 0;
	int count = 0;

	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);
		double scale = blur->sights[c] < BLUR_SIGHTS_MIN ? 0 : scale_m2_px2(m, point, c);

		if (scale == 0)
			continue;
		double px2 = spread_px2(m, point, c);
		sum += scale * (px2 - blur->px2[c]);
		error += scale * (GRID_PX2 + MODEL_SHARE * px2);
		count++;
	}
	if (count == 0)
		return (struct point_size){0};
	double each = DISC / (OBLIQUE * count);
	return (struct point_size){sum * each, error * each};
}

bool point_size_is_larger(const struct point_size *size, double diameter_m)
{
	double least_m2 = size->diameter2_m2 - CLASS_SIGMA * size->sigma_m2;

	return size->sigma_m2 > 0 && least_m2 > CLASS_RATIO2 * diameter_m * diameter_m;
}

bool point_size_is_smaller(const struct point_size *size, double diameter_m)
{
	double most_m2 = size->diameter2_m2 + CLASS_SIGMA * size->sigma_m2;

	return size->sigma_m2 > 0 && CLASS_RATIO2 * most_m2 < diameter_m * diameter_m;
}

bool point_size_fits(const struct point_size *size, double diameter_m)
{
	return !point_size_is_larger(size, diameter_m) && !point_size_is_smaller(size, diameter_m);
}

static void learn_view(struct view_blur *blur, const struct matcher *m, const struct point *point,
		       double diameter_m, uint32_t c)
{
	double scale = scale_m2_px2(m, point, c);

	if (scale == 0)
		return;
	double disc_px2 = OBLIQUE / DISC * diameter_m * diameter_m / scale;
	double off_px2 = spread_px2(m, point, c) - disc_px2 - blur->px2[c];
	double gain = fmax(BLUR_GAIN, 1.0 / (blur->sights[c] + 1));

	blur->px2[c] += gain * fmin(fmax(off_px2, -BLUR_STEP_MAX_PX2), BLUR_STEP_MAX_PX2);
	blur->sights[c] += blur->sights[c] < BLUR_SIGHTS_MIN;
}

/* One diameter for all was told by nobody: then no blur is known, and so no size. */
void point_size_learn(struct tracker_state *state, const struct matcher *m)
{
	if (state->diameter_min_m == state->diameter_max_m)
		return;
	for (uint32_t k = 0; k < POINTS_A_SHOT && k < m->point_count; k++) {
		const struct point *point = &m->points[state->blur.turn++ % m->point_count];

		if (point->label == LABEL_NONE)
			continue;
		for (uint32_t left = point->fix.used_mask; left; left &= left - 1)
			learn_view(&state->blur, m, point, state->labels[point->label].diameter_m,
				   (uint32_t)__builtin_ctz(left));
	}
}
