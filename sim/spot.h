/*
 * One marker's light on a sensor: the disc's ellipse, blurred by a Gaussian and integrated over
 * pixels.
 */
#pragma once

#define SPOT_HALF_WIDTH_PX 16 /* light further than this from the middle is cut off */
#define SPOT_WINDOW_MAX (2 * SPOT_HALF_WIDTH_PX + 2) /* pixels, each way */

struct spot {
	double centre_px[2];
	double axes_px[2][2]; /* column k: where the disc's k-th unit radius falls, minus centre */
	double brightness;    /* grey value of an evenly lit pixel */
};

struct pixel_window {
	int x0, y0, x1, y1; /* x1 and y1 are one past the last */
};

static inline int pixel_window_count(const struct pixel_window *w)
{
	return w->x1 > w->x0 && w->y1 > w->y0 ? (w->x1 - w->x0) * (w->y1 - w->y0) : 0;
}

/* The Gaussian blur of a lens, tabulated. Flat; read by any thread once made. */
struct blur {
	double sigma_px;
	double inverse_step;
	float cumulative[1024]; /* of the standard normal, from -6 to 6 */
};

void blur_init(struct blur *blur, double sigma_px);

/* The pixels that the spot lights, cut off at the border; empty when it falls outside. Pixel (0,0)
 * is the centre of the top-left pixel. */
struct pixel_window spot_window(const struct spot *spot, const struct blur *blur, int width_px,
				int height_px);

/* Fills `light` (grey values, the window's pixels row by row). */
void spot_fill(const struct spot *spot, const struct blur *blur, const struct pixel_window *window,
	       float *light);

/* Grey value at the middle of a small disc facing the camera, per unit of brightness. */
double spot_peak_fraction(double radius_px, double blur_sigma_px);
