/*
 * The inner loops of the centroid, four pixels at a time.
 */
#include "track/blobs_window.h"

#include <math.h>
#include <simde/x86/sse2.h>
#include <string.h>

typedef simde__m128 float4;

static float4 all(float v)
{
	return simde_mm_set1_ps(v);
}
static float4 add(float4 a, float4 b)
{
	return simde_mm_add_ps(a, b);
}
static float4 sub(float4 a, float4 b)
{
	return simde_mm_sub_ps(a, b);
}
static float4 mul(float4 a, float4 b)
{
	return simde_mm_mul_ps(a, b);
}

static float total(float4 v)
{
	float4 pair = add(v, simde_mm_movehl_ps(v, v));

	return simde_mm_cvtss_f32(simde_mm_add_ss(pair, simde_mm_shuffle_ps(pair, pair, 1)));
}

static float4 pixels4(const uint8_t *p)
{
	simde__m128i zero = simde_mm_setzero_si128(), v;
	int32_t bytes;

	memcpy(&bytes, p, sizeof(bytes));
	v = simde_mm_unpacklo_epi8(simde_mm_cvtsi32_si128(bytes), zero);
	return simde_mm_cvtepi32_ps(simde_mm_unpacklo_epi16(v, zero));
}

static const uint8_t *row_at(const struct grey_image *image, int y)
{
	return image->pixels + (ptrdiff_t)y * image->stride_bytes;
}

bool window_around(const struct grey_image *image, float x_px, float y_px, float half_x_px,
		   float half_y_px, struct window *out)
{
	int width = ((int)(2 * half_x_px) + 5) & ~3;

	out->x0 = (int)ceilf(x_px - (float)width / 2);
	out->x1 = out->x0 + width;
	out->y0 = (int)ceilf(y_px - half_y_px);
	out->y1 = (int)floorf(y_px + half_y_px) + 1;
	return out->x0 >= 0 && out->y0 >= 0 && out->x1 <= image->width_px &&
	       out->y1 <= image->height_px;
}

/* Sums of one row and of all of them, of a quantity q: q, q x, q x2 and with the powers of y. */
struct sums {
	float4 q, x, y, xx, xy, yy;
};

static void sums_add_row(struct sums *sums, float4 q, float4 qx, float4 qxx, float4 dy)
{
	float4 qy = mul(q, dy);

	sums->q = add(sums->q, q);
	sums->x = add(sums->x, qx);
	sums->y = add(sums->y, qy);
	sums->xx = add(sums->xx, qxx);
	sums->xy = add(sums->xy, mul(qx, dy));
	sums->yy = add(sums->yy, mul(qy, dy));
}

bool window_moments(const struct grey_image *image, const struct window *window,
		    const struct plane *background, float x_px, float y_px, struct shape *out)
{
	float4 first = sub(simde_mm_setr_ps(0, 1, 2, 3), all(x_px - (float)window->x0));
	struct sums sums;
	float flux, mean_x, mean_y;

	memset(&sums, 0, sizeof(sums));
	for (int y = window->y0; y < window->y1; y++) {
		const uint8_t *row = row_at(image, y);
		float dy = (float)y - y_px;
		float4 base = all(background->value + background->slope_y * dy), dx = first;
		float4 q = all(0), qx = all(0), qxx = all(0);

		for (int x = window->x0; x < window->x1; x += 4) {
			float4 s =
				sub(sub(pixels4(row + x), base), mul(all(background->slope_x), dx));
			float4 sx = mul(s, dx);

			q = add(q, s);
			qx = add(qx, sx);
			qxx = add(qxx, mul(sx, dx));
			dx = add(dx, all(4));
		}
		sums_add_row(&sums, q, qx, qxx, all(dy));
	}
	flux = total(sums.q);
	if (!(flux > 0))
		return false;
	mean_x = total(sums.x) / flux;
	mean_y = total(sums.y) / flux;
	*out = (struct shape){flux, total(sums.xx) / flux - mean_x * mean_x,
			      total(sums.xy) / flux - mean_x * mean_y,
			      total(sums.yy) / flux - mean_y * mean_y};
	return true;
}

/* The three weighted quantities of four pixels: w S, w' S and w2 variance. */
struct weighted {
	float4 value, slope, noise;
};

static struct weighted weigh(const struct kernel *k, float4 s, float4 u)
{
	float4 zero = all(0);
	float4 t = simde_mm_max_ps(sub(all(1), mul(mul(u, u), all(1 / 16.0f))), zero);
	float4 ring = add(all(k->ring[0]), mul(u, add(all(k->ring[1]), mul(u, all(k->ring[2])))));
	float4 ring_slope = add(all(k->ring[1]), mul(u, all(2 * k->ring[2])));
	float4 ring_t = mul(ring, t), w = mul(ring_t, t);
	float4 w_slope = mul(t, sub(mul(ring_slope, t), mul(mul(ring, u), all(0.25f))));
	float4 variance = add(all(k->noise_variance),
			      mul(simde_mm_max_ps(s, zero), all(1 / k->electrons_per_grey)));

	return (struct weighted){mul(w, s), mul(w_slope, s), mul(mul(w, w), variance)};
}

/* Solves slope * step = value for the centre; slope and noise are the sums over the window. */
static bool solve_step(const struct kernel *k, const struct sums *value, const struct sums *slope,
		       const struct sums *noise, struct newton_step *out)
{
	float fx = total(value->x), fy = total(value->y), f = total(value->q);
	float a = total(slope->xx), b = total(slope->xy), c = total(slope->yy);
	float mxx = f + 2 * (k->qxx * a + k->qxy * b), mxy = 2 * (k->qxy * a + k->qyy * b);
	float myx = 2 * (k->qxx * b + k->qxy * c), myy = f + 2 * (k->qxy * b + k->qyy * c);
	float det = mxx * myy - mxy * myx;
	float vxx = total(noise->xx), vxy = total(noise->xy), vyy = total(noise->yy);

	if (!(mxx > 0) || !(det > 1e-6f))
		return false;
	out->dx = (myy * fx - mxy * fy) / det;
	out->dy = (mxx * fy - myx * fx) / det;
	out->variance = (myy * myy * vxx - 2 * myy * mxy * vxy + mxy * mxy * vyy + myx * myx * vxx -
			 2 * myx * mxx * vxy + mxx * mxx * vyy) /
			(2 * det * det);
	return true;
}

bool window_newton(const struct grey_image *image, const struct window *window,
		   const struct plane *background, const struct kernel *k, float x_px, float y_px,
		   struct newton_step *out)
{
	float4 first = sub(simde_mm_setr_ps(0, 1, 2, 3), all(x_px - (float)window->x0));
	struct sums value, slope, noise;

	memset(&value, 0, sizeof(value));
	memset(&slope, 0, sizeof(slope));
	memset(&noise, 0, sizeof(noise));
	for (int y = window->y0; y < window->y1; y++) {
		const uint8_t *row = row_at(image, y);
		float dy = (float)y - y_px;
		float4 base = all(background->value + background->slope_y * dy), dx = first;
		float4 across = all(2 * k->qxy * dy), along = all(k->qyy * dy * dy);
		struct weighted q = {all(0), all(0), all(0)}, qx = q, qxx = q;

		for (int x = window->x0; x < window->x1; x += 4) {
			float4 s =
				sub(sub(pixels4(row + x), base), mul(all(background->slope_x), dx));
			float4 u = add(along, mul(dx, add(across, mul(all(k->qxx), dx))));
			struct weighted w = weigh(k, s, u);
			struct weighted wx = {mul(w.value, dx), mul(w.slope, dx), mul(w.noise, dx)};

			q.value = add(q.value, w.value);
			q.slope = add(q.slope, w.slope);
			q.noise = add(q.noise, w.noise);
			qx.value = add(qx.value, wx.value);
			qx.slope = add(qx.slope, wx.slope);
			qx.noise = add(qx.noise, wx.noise);
			qxx.slope = add(qxx.slope, mul(wx.slope, dx));
			qxx.noise = add(qxx.noise, mul(wx.noise, dx));
			dx = add(dx, all(4));
		}
		sums_add_row(&value, q.value, qx.value, qxx.value, all(dy));
		sums_add_row(&slope, q.slope, qx.slope, qxx.slope, all(dy));
		sums_add_row(&noise, q.noise, qx.noise, qxx.noise, all(dy));
	}
	return solve_step(k, &value, &slope, &noise, out);
}
