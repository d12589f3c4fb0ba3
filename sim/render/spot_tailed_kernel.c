/*
 * The kernels: point spread, defocus and pixel convolved on a grid of eighths of a pixel.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/render/spot_tailed.h"

#define FINE 8                                /* samples per pixel */
#define OUT (FINE * TAIL_REACH_PX + FINE / 2) /* farthest sample of a kernel */
#define BOX 3                                 /* 7/8 of a pixel's width is lit: 2 * 3 + 1 */
#define DISC (FINE * TAIL_LEVELS / (2 * TAIL_LEVELS_PER_PX)) /* widest radius of defocus */
#define REACH (OUT + BOX + DISC)
#define SIDE (2 * REACH + 1)
#define EXPONENT 2.5

struct samples {
	double at[SIDE][SIDE];
};

static void fill_moffat(struct samples *out, double moffat_px)
{
	for (int y = -REACH; y <= REACH; y++)
		for (int x = -REACH; x <= REACH; x++) {
			double r2 = (double)(x * x + y * y) / (FINE * FINE);

			out->at[y + REACH][x + REACH] =
				pow(1 + r2 / (moffat_px * moffat_px), -EXPONENT);
		}
}

/* The sum over the pixel's lit square; the outermost BOX samples are left as they are. */
static void add_box(struct samples *samples, struct samples *before)
{
	static const int dx[2] = {1, 0};

	for (int pass = 0; pass < 2; pass++) {
		*before = *samples;
		for (int y = BOX; y < SIDE - BOX; y++)
			for (int x = BOX; x < SIDE - BOX; x++) {
				double sum = 0;

				for (int i = -BOX; i <= BOX; i++)
					sum += before->at[y + i * !dx[pass]][x + i * dx[pass]];
				samples->at[y][x] = sum;
			}
	}
}

/* Convolves with a disc; only places up to OUT are wanted. Rows are summed up first, so that a row
 * of the disc is one difference. */
static void spread_disc(const struct samples *in, double radius, struct samples *sums,
			struct samples *out)
{
	int reach = (int)radius;

	for (int y = 0; y < SIDE; y++) {
		sums->at[y][0] = 0;
		for (int x = 1; x < SIDE; x++)
			sums->at[y][x] = sums->at[y][x - 1] + in->at[y][x - 1];
	}
	memset(out, 0, sizeof(*out));
	for (int dy = -reach; dy <= reach; dy++) {
		int half = (int)sqrt(radius * radius - dy * dy);

		for (int y = REACH - OUT; y <= REACH + OUT; y++)
			for (int x = REACH - OUT; x <= REACH + OUT; x++)
				out->at[y][x] +=
					sums->at[y + dy][x + half + 1] - sums->at[y + dy][x - half];
	}
}

struct sums {
	double all, x, y, xx, yy;
};

static struct sums sum_up(const float *kernel, const double offset[2])
{
	struct sums s = {0};

	for (int i = 0; i < TAIL_SIDE * TAIL_SIDE; i++) {
		double x = i % TAIL_SIDE - TAIL_REACH_PX - offset[0];
		double y = i / TAIL_SIDE - TAIL_REACH_PX - offset[1], k = kernel[i];

		s.all += k;
		s.x += k * x;
		s.y += k * y;
		s.xx += k * x * x;
		s.yy += k * y * y;
	}
	return s;
}

/* All light, and its first moment on the source: cut and sampled kernels lack both by a little. */
static void balance(float *kernel, const double offset[2])
{
	for (int pass = 0; pass < 3; pass++) {
		struct sums s = sum_up(kernel, offset);

		for (int i = 0; i < TAIL_SIDE * TAIL_SIDE; i++) {
			double x = i % TAIL_SIDE - TAIL_REACH_PX - offset[0];
			double y = i / TAIL_SIDE - TAIL_REACH_PX - offset[1];

			kernel[i] *= (float)((1 - x * s.x / s.xx - y * s.y / s.yy) / s.all);
		}
	}
}

/* The source lies (phase - 1) quarters of a pixel from the middle pixel's centre. */
static void pick_kernel(const struct samples *samples, int phase_x, int phase_y, float *kernel)
{
	int at_x = (phase_x - 1) * FINE / TAIL_PHASES, at_y = (phase_y - 1) * FINE / TAIL_PHASES;
	double offset[2] = {(double)at_x / FINE, (double)at_y / FINE};

	for (int i = 0; i < TAIL_SIDE * TAIL_SIDE; i++) {
		int x = FINE * (i % TAIL_SIDE - TAIL_REACH_PX) - at_x;
		int y = FINE * (i / TAIL_SIDE - TAIL_REACH_PX) - at_y;

		kernel[i] = (float)samples->at[y + REACH][x + REACH];
	}
	balance(kernel, offset);
}

int tail_blur_create(struct tail_blur **out, double moffat_px)
{
	struct tail_blur *blur = calloc(1, sizeof(*blur));
	struct samples *work = calloc(3, sizeof(*work));

	if (!blur || !work) {
		free(blur);
		free(work);
		return -ENOMEM;
	}
	fill_moffat(&work[0], moffat_px);
	add_box(&work[0], &work[1]);
	for (int level = 0; level < TAIL_LEVELS; level++) {
		spread_disc(&work[0], 0.5 * FINE * level / TAIL_LEVELS_PER_PX, &work[1], &work[2]);
		for (int p = 0; p < TAIL_PHASES * TAIL_PHASES; p++)
			pick_kernel(&work[2], p % TAIL_PHASES, p / TAIL_PHASES,
				    blur->kernels[level][p]);
	}
	free(work);
	*out = blur;
	return 0;
}

void tail_blur_destroy(struct tail_blur *blur)
{
	free(blur);
}
