/*
 * Pictures for the blob tests, made apart from sim/: discs blurred by a Gaussian and integrated
 * over the pixels, on any background, with read and photon noise, and what the best possible
 * estimator could do with each.
 */
#pragma once

#include <stdint.h>

#include "base/rng.h"
#include "track/blobs/blobs.h"

struct picture {
	int width_px, height_px;
	float *light;    /* noiseless, grey values */
	uint8_t *pixels; /* what the camera gives */
};

struct true_spot {
	double x_px, y_px;
	double diameter_px; /* long axis of the disc */
	double axis_ratio;  /* short over long axis */
	double angle_rad;   /* of the long axis */
	double psf_px;      /* standard deviation of the blur */
	double amplitude;   /* of the brightest point, grey values */
};

struct picture picture_create(int width_px, int height_px, double background);
void picture_destroy(struct picture *picture);

/* Adds the spot; returns the Cramer-Rao bound of x and y (rms of the two), for the given read noise
 * and 40 electrons per grey value. */
double picture_add(struct picture *picture, const struct true_spot *spot, double read_noise);

/* Adds a smooth hill of light, or with sharp set, an elliptic plateau. */
void picture_add_glow(struct picture *picture, double x_px, double y_px, double radius_px,
		      double amplitude, int sharp);

/* Noise, quantisation, clipping. */
void picture_expose(struct picture *picture, double read_noise, struct rng *rng);

struct grey_image picture_image(const struct picture *picture);

/* The blob nearest to (x, y) within 1.5 px, or NULL. */
const struct blob *blob_near(const struct blob_set *set, double x_px, double y_px);
