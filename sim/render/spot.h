/*
 * One marker's light on a sensor. Two unlike ways lead from its outline to pixels: here its outline
 * is a sum of points, each blurred by a Gaussian and integrated over pixels;
 * sim/render/spot_tailed.h does it otherwise.
 */
#pragma once

#define SPOT_HALF_WIDTH_PX 48 /* light further than this from the middle is cut off */
#define SPOT_WINDOW_MAX (2 * SPOT_HALF_WIDTH_PX + 2) /* pixels, each way */

/* The outline is a unit disc (x, y) whose half with y < 0 is squeezed, taken to pixels by the axes.
 * A disc's image is not squeezed; a hemisphere's is: its far half is that of its base. */
struct spot {
	double centre_px[2];  /* of the disc or of the hemisphere's base */
	double axes_px[2][2]; /* column k: where the k-th unit radius falls, minus centre */
	double squeeze;       /* of the far half, by how much narrower: 0 = none, towards 1 */
	double brightness;    /* grey value of an evenly lit pixel */
	double defocus_px;    /* diameter of the disc that a point out of focus makes */
};

struct pixel_window {
	int x0, y0, x1, y1; /* x1 and y1 are one past the last */
};

static inline int pixel_window_count(const struct pixel_window *w)
{
	return w->x1 > w->x0 && w->y1 > w->y0 ? (w->x1 - w->x0) * (w->y1 - w->y0) : 0;
}

/* The pixels of an image within `reach_px` of a place; empty when it is outside. Pixel (0,0) is the
 * centre of the top-left pixel. */
struct pixel_window pixel_window_around(const double centre_px[2], double reach_px, int width_px,
					int height_px);

/* The longest radius of the outline, and all its light: grey values summed over pixels. */
double spot_radius_px(const struct spot *spot);
double spot_light(const struct spot *spot);

/* Where the light's first moment is: the centre, but for a hemisphere, whose is 4 / (3 pi) *
 * squeeze of its radius to the near side. */
void spot_centroid(const struct spot *spot, double out[2]);

/* The Gaussian blur of a lens, tabulated. Flat; read by any thread once made. */
struct blur {
	double sigma_px;
	double inverse_step;
	float cumulative[1024]; /* of the standard normal, from -6 to 6 */
};

void blur_init(struct blur *blur, double sigma_px);

/* The pixels that the spot lights, cut off at the border; empty when it falls outside. */
struct pixel_window spot_window(const struct spot *spot, const struct blur *blur, int width_px,
				int height_px);

/* Fills `light` (grey values, the window's pixels row by row). */
void spot_fill(const struct spot *spot, const struct blur *blur, const struct pixel_window *window,
	       float *light);

/* Grey value at the middle of a small disc facing the camera, per unit of brightness. */
double spot_peak_fraction(double radius_px, double blur_sigma_px);
