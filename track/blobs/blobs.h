/*
 * Finds the bright spots of an IR image and their centroids.
 *
 * Detection: threshold at background + k sigma, both measured from the image itself around each
 * place; runs; union of touching runs. Centroid: from the moment of (I - T), one Newton step of a
 * windowed first moment whose window follows the spot's own size and shape (SExtractor's windowed
 * positions, Bertin & Arnouts 1996, widened from Gaussians to discs). Touching spots are parted at
 * their saddle. Every blob carries flags and its sigma from the noise model. The same image gives
 * the same bits.
 */
#pragma once

#include <stdint.h>

#include "track/observe.h"

/* A grey image, borrowed: rows of bytes, or of little-endian words on an even address. */
struct grey_image {
	const uint8_t *pixels;
	int width_px, height_px;
	int stride_bytes;
	int bits; /* of a grey value: 9 to 16 in words; up to 8 (0 too) in bytes */
};

/* Grey values here are 256ths of the full scale, however many bits a pixel has. */
struct blob_settings {
	double threshold_sigma; /* detection level above the background; default 6 */
	double threshold_min;   /* grey values; at least this far above the background; default 8 */
	double electrons_per_grey; /* photon noise: variance = read^2 + signal / this; default 40 */
	int area_min_px; /* smaller ones are hot pixels, unless light surrounds them; default 3 */
	int area_max_px; /* larger ones are lamps and windows; default 20000 */
};

struct blob_settings blob_settings_default(void);

/* Scratch memory of one camera: no allocation per frame, nothing carried from frame to frame. */
struct blob_finder;

/* Returns 0 or -ENOMEM. destroy accepts NULL. */
int blob_finder_create(struct blob_finder **out, int width_px, int height_px,
		       const struct blob_settings *settings);
void blob_finder_destroy(struct blob_finder *finder);

/* Fills blobs, blob_count and blobs_lost of `set`, ordered by their topmost row, then from left
 * to right; leaves the other fields alone. Real-time safe. The image must have the size that the
 * finder was made for; its pixels may have any number of bits. */
void blob_finder_run(struct blob_finder *finder, const struct grey_image *image,
		     struct blob_set *set);
