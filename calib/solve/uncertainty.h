/*
 * How far off points of the stage may be because the calibration is: one sigma, from the noise of
 * the corners through the whole solve. First order: the Jacobian at the solution, factorised by
 * CHOLMOD (as in mrcal's "uncertainty" documentation, with the rigid motion of the whole stage
 * taken out, which no one measures). The noise of markers' own pixels comes on top of it.
 */
#pragma once

#include "calib/solve/solve.h"
#include "calib/solve/volume.h"

struct uncertainty {
	uint32_t count;                        /* points, as of the volume */
	double cov_m2[VOLUME_POINT_MAX][3][3]; /* of a point that all its cameras triangulate */
	double rms_m;                          /* of the distance, over the volume */
	double worst_m;                        /* of the distance, at point `worst` */
	uint32_t worst;
};

/* `observations` are those that the solution is of. Returns 0, -ENOMEM, or -EDOM when the
 * observations do not determine the rig. */
int uncertainty_find(struct uncertainty *uncertainty, const struct solution *solution,
		     const struct observations *observations, const struct volume *volume);
