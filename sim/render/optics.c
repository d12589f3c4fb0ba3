/*
 * Chooses between the two models.
 */
#include "sim/render/optics.h"

#include <math.h>
#include <string.h>

#include "base/rng.h"

#define SHARPEST_SIGMA_PX 0.8
#define SOFTER_SIGMA_PX 0.2
#define CORNER_DEFOCUS_PX 2.0 /* of the tailed model's curved field */
#define SHARPEST_MOFFAT_PX 1.3
#define SOFTER_MOFFAT_PX 0.3
#define SIGMA_PER_MOFFAT 0.64 /* gives small spots nearly the same peak */

double optics_share(uint64_t seed, uint32_t camera)
{
	struct rng rng;

	rng_init(&rng, seed, 48 + camera);
	return rng_uniform(&rng);
}

int optics_init(struct optics *optics, int kind, double share, int width_px, int height_px)
{
	memset(optics, 0, sizeof(*optics));
	optics->kind = kind;
	optics->width_px = width_px;
	optics->height_px = height_px;
	if (kind == SIM_OPTICS_TAILED)
		return tail_blur_create(&optics->tail,
					SHARPEST_MOFFAT_PX + SOFTER_MOFFAT_PX * share);
	blur_init(&optics->blur, optics_sigma_px(kind, share));
	return 0;
}

void optics_finish(struct optics *optics)
{
	tail_blur_destroy(optics->tail);
	memset(optics, 0, sizeof(*optics));
}

double optics_sigma_px(int kind, double share)
{
	return kind == SIM_OPTICS_TAILED
		       ? SIGMA_PER_MOFFAT * (SHARPEST_MOFFAT_PX + SOFTER_MOFFAT_PX * share)
		       : SHARPEST_SIGMA_PX + SOFTER_SIGMA_PX * share;
}

double optics_defocus_px(int kind, int width_px, int height_px, const struct spot *spot)
{
	double x = 2 * spot->centre_px[0] / width_px - 1;
	double y = 2 * spot->centre_px[1] / height_px - 1;
	double corner_px = CORNER_DEFOCUS_PX * fmin(0.5 * (x * x + y * y), 1);

	return kind == SIM_OPTICS_TAILED ? hypot(spot->defocus_px, corner_px) : spot->defocus_px;
}

struct pixel_window optics_window(const struct optics *optics, const struct spot *spot)
{
	return optics->tail ? tail_spot_window(spot, optics->width_px, optics->height_px)
			    : spot_window(spot, &optics->blur, optics->width_px, optics->height_px);
}

void optics_fill(struct optics *optics, const struct spot *spot, const struct pixel_window *window,
		 float *light)
{
	struct spot softer = *spot;

	softer.defocus_px =
		optics_defocus_px(optics->kind, optics->width_px, optics->height_px, spot);
	if (optics->tail)
		tail_spot_fill(optics->tail, &softer, window, light);
	else
		spot_fill(spot, &optics->blur, window, light);
}
