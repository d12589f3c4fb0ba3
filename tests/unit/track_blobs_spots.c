/*
 * The light of a blurred disc in a pixel: the mean over points of the disc of the Gaussian's
 * integral over the pixel, which is a product of error functions.
 */
#include "track_blobs_spots.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define REACH_MAX 48
#define ELECTRONS_PER_GREY 40

struct picture picture_create(int width_px, int height_px, double background)
{
	size_t count = (size_t)width_px * (size_t)height_px;
	struct picture picture = {width_px, height_px, malloc(count * sizeof(float)),
				  calloc(count, 1)};

	for (size_t i = 0; i < count; i++)
		picture.light[i] = (float)background;
	return picture;
}

void picture_destroy(struct picture *picture)
{
	free(picture->light);
	free(picture->pixels);
	memset(picture, 0, sizeof(*picture));
}

/* Integral of the Gaussian over each pixel of one axis, and its derivative by the centre. */
static void pixel_profile(double centre, double sigma, int first, int count, double *light,
			  double *slope)
{
	double last = erf((first - 0.5 - centre) / (sigma * M_SQRT2));
	double norm = 1 / (sigma * sqrt(2 * M_PI));
	double last_density = norm * exp(-0.5 * pow((first - 0.5 - centre) / sigma, 2));

	for (int i = 0; i < count; i++) {
		double edge = first + i + 0.5 - centre;
		double next = erf(edge / (sigma * M_SQRT2));
		double density = norm * exp(-0.5 * edge * edge / (sigma * sigma));

		light[i] = (next - last) / 2;
		slope[i] = last_density - density;
		last = next;
		last_density = density;
	}
}

struct stamp {
	int x0, y0, size;
	double light[2 * REACH_MAX][2 * REACH_MAX], dx[2 * REACH_MAX][2 * REACH_MAX],
		dy[2 * REACH_MAX][2 * REACH_MAX];
};

static void stamp_point(struct stamp *stamp, double x, double y, double sigma)
{
	double lx[2 * REACH_MAX], sx[2 * REACH_MAX], ly[2 * REACH_MAX], sy[2 * REACH_MAX];

	pixel_profile(x, sigma, stamp->x0, stamp->size, lx, sx);
	pixel_profile(y, sigma, stamp->y0, stamp->size, ly, sy);
	for (int j = 0; j < stamp->size; j++)
		for (int i = 0; i < stamp->size; i++) {
			stamp->light[j][i] += lx[i] * ly[j];
			stamp->dx[j][i] += sx[i] * ly[j];
			stamp->dy[j][i] += lx[i] * sy[j];
		}
}

/* Points of the disc on a grid symmetric about its centre. Returns how many. */
static int stamp_disc(struct stamp *stamp, const struct true_spot *spot)
{
	int points = (int)fmax(4, ceil(spot->diameter_px / spot->psf_px * 2)), count = 0;
	double c = cos(spot->angle_rad), s = sin(spot->angle_rad), r = spot->diameter_px / 2;

	points = points > 32 ? 32 : points;
	for (int i = 0; i < points; i++)
		for (int j = 0; j < points; j++) {
			double u = (2 * i + 1.0) / points - 1, v = (2 * j + 1.0) / points - 1;

			if (u * u + v * v > 1)
				continue;
			u *= r;
			v *= r * spot->axis_ratio;
			stamp_point(stamp, spot->x_px + c * u - s * v, spot->y_px + s * u + c * v,
				    spot->psf_px);
			count++;
		}
	return count;
}

/* Light at the middle of a blurred disc whose total is 1: the scale to `amplitude`. */
static double middle(const struct true_spot *spot)
{
	double sum = 0;
	int count = 0;

	for (int i = 0; i < 64; i++)
		for (int j = 0; j < 64; j++) {
			double u = (2 * i + 1.0) / 64 - 1, v = (2 * j + 1.0) / 64 - 1;
			double r2 = u * u + v * v * spot->axis_ratio * spot->axis_ratio;

			if (u * u + v * v > 1)
				continue;
			sum += exp(-r2 * pow(spot->diameter_px / 2 / spot->psf_px, 2) / 2);
			count++;
		}
	return sum / count / (2 * M_PI * spot->psf_px * spot->psf_px);
}

static double bound(const struct stamp *stamp, double scale, double read_noise)
{
	double xx = 0, xy = 0, yy = 0;

	for (int j = 0; j < stamp->size; j++)
		for (int i = 0; i < stamp->size; i++) {
			double v = read_noise * read_noise + 1 / 12.0 +
				   scale * stamp->light[j][i] / ELECTRONS_PER_GREY;

			xx += scale * scale * stamp->dx[j][i] * stamp->dx[j][i] / v;
			xy += scale * scale * stamp->dx[j][i] * stamp->dy[j][i] / v;
			yy += scale * scale * stamp->dy[j][i] * stamp->dy[j][i] / v;
		}
	return sqrt((xx + yy) / (2 * (xx * yy - xy * xy)));
}

double picture_add(struct picture *picture, const struct true_spot *spot, double read_noise)
{
	static struct stamp stamp;
	int reach = (int)ceil(spot->diameter_px / 2 + 5 * spot->psf_px) + 1;
	double scale;

	reach = reach > REACH_MAX ? REACH_MAX : reach;
	memset(&stamp, 0, sizeof(stamp));
	stamp.x0 = (int)floor(spot->x_px) - reach + 1;
	stamp.y0 = (int)floor(spot->y_px) - reach + 1;
	stamp.size = 2 * reach;
	scale = spot->amplitude / middle(spot) / stamp_disc(&stamp, spot);
	for (int j = 0; j < stamp.size; j++)
		for (int i = 0; i < stamp.size; i++) {
			int x = stamp.x0 + i, y = stamp.y0 + j;

			if (x >= 0 && y >= 0 && x < picture->width_px && y < picture->height_px)
				picture->light[(size_t)y * (size_t)picture->width_px + (size_t)x] +=
					(float)(scale * stamp.light[j][i]);
		}
	return bound(&stamp, scale, read_noise);
}

void picture_add_glow(struct picture *picture, double x_px, double y_px, double radius_px,
		      double amplitude, int sharp)
{
	for (int y = 0; y < picture->height_px; y++)
		for (int x = 0; x < picture->width_px; x++) {
			double r2 = ((x - x_px) * (x - x_px) + (y - y_px) * (y - y_px)) /
				    (radius_px * radius_px);
			double add = sharp ? (r2 < 1) * amplitude : amplitude * exp(-r2 / 2);

			picture->light[(size_t)y * (size_t)picture->width_px + (size_t)x] +=
				(float)add;
		}
}

void picture_expose(struct picture *picture, double read_noise, struct rng *rng)
{
	size_t count = (size_t)picture->width_px * (size_t)picture->height_px;

	for (size_t i = 0; i < count; i++) {
		double light = (double)picture->light[i];
		double sigma = sqrt(read_noise * read_noise + light / ELECTRONS_PER_GREY);
		double value = floor(light + sigma * rng_normal(rng) + 0.5);

		picture->pixels[i] = (uint8_t)fmin(fmax(value, 0), 255);
	}
}

struct grey_image picture_image(const struct picture *picture)
{
	return (struct grey_image){picture->pixels, picture->width_px, picture->height_px,
				   picture->width_px, 8};
}

const struct blob *blob_near(const struct blob_set *set, double x_px, double y_px)
{
	const struct blob *best = NULL;
	double best_px = 1.5;

	for (uint32_t b = 0; b < set->blob_count; b++) {
		double d =
			hypot((double)set->blobs[b].x_px - x_px, (double)set->blobs[b].y_px - y_px);

		if (d < best_px) {
			best_px = d;
			best = &set->blobs[b];
		}
	}
	return best;
}
