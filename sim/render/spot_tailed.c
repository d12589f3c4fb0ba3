/*
 * Slices of the outline on a fine grid: a slice gives each cell the integral of the cell's hat
 * function, so that area and first moment are those of the slice at every phase.
 */
#include "sim/render/spot_tailed.h"

#include <math.h>
#include <string.h>

#define CORNERS 48
#define SLICES_MIN 24
#define COARSE_RADIUS_PX 2.5 /* from here on the grid has two cells per pixel, below four */
#define HALO_SHARE 0.015     /* of the light, scattered in lens and cover glass */
#define HALO_PX 5.0          /* falls by e */
#define HALO_FAINT_GREY 0.05

struct slice {
	double y, left, right, height; /* in cells */
};

/* A window of the fine grid; cell (0,0) is cell (x0,y0) of the image's, whose cell k is k / per_px
 * pixels from the first pixel's centre. */
struct cells {
	int per_px;
	int x0, y0, x_count, y_count;
	float *light;
};

/* How far the halo is worth drawing. */
static double halo_reach_px(double light)
{
	double middle = HALO_SHARE * light / (2 * M_PI * HALO_PX * HALO_PX);

	return middle > HALO_FAINT_GREY ? HALO_PX * log(middle / HALO_FAINT_GREY) : 0;
}

struct pixel_window tail_spot_window(const struct spot *spot, int width_px, int height_px)
{
	double reach =
		fmax(spot_radius_px(spot) + TAIL_REACH_PX + 1, halo_reach_px(spot_light(spot)));

	return pixel_window_around(spot->centre_px, reach, width_px, height_px);
}

static void find_corners(const struct spot *spot, double per_px, double corners[CORNERS + 1][2])
{
	const double(*a)[2] = spot->axes_px;

	for (int i = 0; i <= CORNERS; i++) {
		double x = cos(2 * M_PI * i / CORNERS), y = sin(2 * M_PI * i / CORNERS);

		y *= y < 0 ? 1 - spot->squeeze : 1;
		for (int k = 0; k < 2; k++)
			corners[i][k] = per_px * (spot->centre_px[k] + a[k][0] * x + a[k][1] * y);
	}
}

/* Where the line at `y` enters and leaves the polygon. */
static struct slice cut(const double (*corners)[2], double y, double height)
{
	struct slice slice = {y, INFINITY, -INFINITY, height};

	for (int i = 0; i < CORNERS; i++) {
		const double *p = corners[i], *q = corners[i + 1];

		if ((p[1] < y) == (q[1] < y))
			continue;
		double x = p[0] + (q[0] - p[0]) * (y - p[1]) / (q[1] - p[1]);

		slice.left = fmin(slice.left, x);
		slice.right = fmax(slice.right, x);
	}
	return slice;
}

/* Integral of the hat function up to t: 0 at -1, 1 at 1. */
static double hat_integral(double t)
{
	if (t <= -1)
		return 0;
	if (t >= 1)
		return 1;
	return t < 0 ? 0.5 * (1 + t) * (1 + t) : 1 - 0.5 * (1 - t) * (1 - t);
}

static void lay_slice(const struct cells *cells, const struct slice *slice)
{
	int row = (int)floor(slice->y) - cells->y0;
	int first = (int)floor(slice->left) - cells->x0, last = (int)ceil(slice->right) - cells->x0;
	double below = slice->y - floor(slice->y);

	if (row < 0 || row + 1 >= cells->y_count || first < 0 || last >= cells->x_count)
		return;
	float *upper = cells->light + row * cells->x_count, *lower = upper + cells->x_count;

	for (int x = first; x <= last; x++) {
		double at = x + cells->x0;
		double area = slice->height *
			      (hat_integral(slice->right - at) - hat_integral(slice->left - at));

		upper[x] += (float)((1 - below) * area);
		lower[x] += (float)(below * area);
	}
}

static struct cells cells_around(const struct spot *spot, float *light)
{
	double radius_px = fmin(spot_radius_px(spot), SPOT_HALF_WIDTH_PX - 2);
	int per_px = radius_px < COARSE_RADIUS_PX ? 4 : 2;
	int count = 2 * (int)ceil(radius_px * per_px) + 6;
	struct cells cells = {.per_px = per_px,
			      .x0 = (int)floor(spot->centre_px[0] * per_px) - count / 2,
			      .y0 = (int)floor(spot->centre_px[1] * per_px) - count / 2,
			      .x_count = count,
			      .y_count = count,
			      .light = light};

	memset(light, 0, (size_t)(count * count) * sizeof(*light));
	return cells;
}

static void lay_outline(const struct cells *cells, const struct spot *spot)
{
	double corners[CORNERS + 1][2], top = INFINITY, bottom = -INFINITY;

	find_corners(spot, cells->per_px, corners);
	for (int i = 0; i < CORNERS; i++) {
		top = fmin(top, corners[i][1]);
		bottom = fmax(bottom, corners[i][1]);
	}
	int count = (int)fmax(SLICES_MIN, 2 * ceil(bottom - top));
	double height = (bottom - top) / count;

	for (int i = 0; i < count; i++) {
		struct slice slice = cut(corners, top + (i + 0.5) * height, height);

		if (slice.left < slice.right)
			lay_slice(cells, &slice);
	}
}

/* The kernels of this spot's defocus, between the levels that are made. */
static void mix_kernels(struct tail_blur *blur, double defocus_px)
{
	double place = fmin(defocus_px * TAIL_LEVELS_PER_PX, TAIL_LEVELS - 1.001);
	int level = (int)place;
	float far = (float)(place - level);

	for (int p = 0; p < TAIL_PHASES * TAIL_PHASES; p++) {
		const float *a = blur->kernels[level][p], *b = blur->kernels[level + 1][p];

		for (int i = 0; i < TAIL_SIDE * TAIL_SIDE; i++)
			blur->kernel[p][i] = a[i] + far * (b[i] - a[i]);
	}
}

static void add_kernel(const float *kernel, int x_px, int y_px, float share,
		       const struct pixel_window *w, float *light)
{
	int left = x_px - TAIL_REACH_PX, top = y_px - TAIL_REACH_PX;
	int x0 = left > w->x0 ? left : w->x0, y0 = top > w->y0 ? top : w->y0;
	int x1 = left + TAIL_SIDE < w->x1 ? left + TAIL_SIDE : w->x1;
	int y1 = top + TAIL_SIDE < w->y1 ? top + TAIL_SIDE : w->y1;

	for (int y = y0; y < y1; y++) {
		const float *from = kernel + (y - top) * TAIL_SIDE - left;
		float *to = light + (y - w->y0) * (w->x1 - w->x0) - w->x0;

		for (int x = x0; x < x1; x++)
			to[x] += share * from[x];
	}
}

/* Kernels know the source as 0 to 3: a quarter before the pixel's centre, on it, one or two behind
 * it. */
static void spread_cells(const struct tail_blur *blur, const struct cells *cells, float brightness,
			 const struct pixel_window *w, float *light)
{
	int step = TAIL_PHASES / cells->per_px;

	for (int i = 0; i < cells->x_count * cells->y_count; i++) {
		if (cells->light[i] == 0)
			continue;
		int x = step * (cells->x0 + i % cells->x_count) + 1;
		int y = step * (cells->y0 + i / cells->x_count) + 1;
		int phase = (y & (TAIL_PHASES - 1)) * TAIL_PHASES + (x & (TAIL_PHASES - 1));

		add_kernel(blur->kernel[phase], x >> 2, y >> 2, brightness * cells->light[i], w,
			   light);
	}
}

static void add_halo(const struct spot *spot, const struct pixel_window *w, float *light)
{
	double sum = spot_light(spot), reach = halo_reach_px(sum), middle[2];
	float peak = (float)(HALO_SHARE * sum / (2 * M_PI * HALO_PX * HALO_PX));

	spot_centroid(spot, middle);
	for (int y = w->y0; y < w->y1; y++)
		for (int x = w->x0; x < w->x1; x++, light++) {
			float r = hypotf((float)(x - middle[0]), (float)(y - middle[1]));

			if (r < (float)reach)
				*light += peak * expf(-r / (float)HALO_PX);
		}
}

void tail_spot_fill(struct tail_blur *blur, const struct spot *spot,
		    const struct pixel_window *window, float *light)
{
	struct cells cells = cells_around(spot, blur->grid);
	double per_cell = (1 - HALO_SHARE) * spot->brightness / (cells.per_px * cells.per_px);

	memset(light, 0, (size_t)pixel_window_count(window) * sizeof(*light));
	lay_outline(&cells, spot);
	mix_kernels(blur, spot->defocus_px);
	spread_cells(blur, &cells, (float)per_cell, window, light);
	if (halo_reach_px(spot_light(spot)) > 0)
		add_halo(spot, window, light);
}
