/*
 * What a blob's spread says: how large the marker is, and where two markers are that were seen as
 * one. Pure arithmetic on the numbers of one blob.
 *
 * A uniform disc of diameter D spreads its light by D2/16 along every axis, seen obliquely less
 * along the short one; lens blur and the pixel add the same to both. So the long axis tells the
 * diameter, whatever the marker's brightness, where an area above a threshold does not.
 */
#pragma once

#include <stdbool.h>

#include "track/observe.h"

/* The two axes of a blob's spread; angle_rad of the major one, from x towards y. */
struct blob_axes {
	double major_px2, minor_px2;
	double sigma_px2; /* standard deviation of either */
	double angle_rad;
};

/* Returns false when the blob's spread is not known. */
bool blob_axes(const struct blob *blob, struct blob_axes *out);

struct blob_diameter {
	double diameter_m, sigma_m;
};

/* The marker's diameter when its range is known: `m_per_px` is range over focal length, `blur_px2`
 * the spread of a point of light in that camera (blur and pixel; the least spread it ever shows).
 * Of clipped blobs this is an upper bound and sigma says so. Returns false when the blob's
 * spread is not known, or when it is merged or cut by the border. */
bool blob_estimate_diameter(const struct blob *blob, double m_per_px, double blur_px2,
			    struct blob_diameter *out);

/* The two places in one blob, when two equal markers are known to be in it: `part_px2` is the
 * spread of one of them along the line between the two, from the camera's other blobs of the same
 * kind (or the blob's own minor axis, where the markers are round). The parts' sigma_px is that
 * along the line, where it is larger. Returns false when the blob is not longer than one marker by
 * two standard deviations. */
bool blob_split_two(const struct blob *blob, double part_px2, struct blob out[2]);
