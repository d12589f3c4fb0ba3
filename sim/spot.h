/*
 * One marker's light on a sensor: the disc's ellipse, blurred by a Gaussian and integrated over
 * pixels.
 */
#pragma once

#define SPOT_HALF_WIDTH_PX 16 /* light further than this from the middle is cut off */

struct spot {
	double centre_px[2];
	double axes_px[2][2]; /* column k: where the disc's k-th unit radius falls, minus centre */
	double brightness;    /* grey value of an evenly lit pixel */
};

struct pixel_window {
	int x0, y0, x1, y1; /* x1 and y1 are one past the last */
};

/* The Gaussian blur of a lens, tabulated. Flat; read by any thread once made. */
struct blur {
	double sigma_px;
	double inverse_step;
	float cumulative[1024]; /* of the standard normal, from -6 to 6 */
};

void blur_init(struct blur *blur, double sigma_px);

/* Adds the spot's light to `plane` (grey values, stride `width_px`); the window it touched is
 * empty when it falls outside. Pixel (0,0) is the centre of the top-left pixel. */
struct pixel_window spot_add(const struct spot *spot, const struct blur *blur, float *plane,
			     int width_px, int height_px);

/* Grey value at the middle of a small disc facing the camera, per unit of brightness. */
double spot_peak_fraction(double radius_px, double blur_sigma_px);
