/*
 * Chooses between the two models.
 */
#include "sim/optics.h"

#include <string.h>

#include "base/rng.h"

#define SHARPEST_SIGMA_PX 0.8
#define SOFTER_SIGMA_PX 0.2
#define SHARPEST_MOFFAT_PX 1.3
#define SOFTER_MOFFAT_PX 0.3
#define SIGMA_PER_MOFFAT 0.64 /* gives small spots nearly the same peak */

double optics_share(uint64_t seed, uint32_t camera)
{
	struct rng rng;

	rng_init(&rng, seed, 48 + camera);
	return rng_uniform(&rng);
}

int optics_init(struct optics *optics, int kind, double share)
{
	memset(optics, 0, sizeof(*optics));
	optics->kind = kind;
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

struct pixel_window optics_window(const struct optics *optics, const struct spot *spot,
				  int width_px, int height_px)
{
	return optics->tail ? tail_spot_window(spot, width_px, height_px)
			    : spot_window(spot, &optics->blur, width_px, height_px);
}

void optics_fill(struct optics *optics, const struct spot *spot, const struct pixel_window *window,
		 float *light)
{
	if (optics->tail)
		tail_spot_fill(optics->tail, spot, window, light);
	else
		spot_fill(spot, &optics->blur, window, light);
}
