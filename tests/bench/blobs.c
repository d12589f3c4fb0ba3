/*
 * What finding blobs costs over plainly reading the frame: bench-blobs [SPOTS [DIAMETER_PX]]
 * (default 110 spots of 3 px). Frames come from a pool larger than twice the last-level cache; the
 * two are timed in turn on different frames, so that load on the machine meets both. Prints JSON.
 */
#include <simde/x86/sse2.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "tests/unit/track_blobs_spots.h"

#define WIDTH 1280
#define HEIGHT 1024
#define FRAME_BYTES ((size_t)WIDTH * HEIGHT)
#define FRAME_COUNT 64  /* 80 MB */
#define PICTURE_COUNT 4 /* different ones among them */
#define ROUND_COUNT 20

static int64_t sum_frame(const uint8_t *frame)
{
	simde__m128i zero = simde_mm_setzero_si128(), even = zero, odd = zero;
	const simde__m128i *p = (const simde__m128i *)(const void *)frame;

	for (size_t i = 0; i < FRAME_BYTES / sizeof(*p); i += 4) {
		simde__m128i a = simde_mm_sad_epu8(simde_mm_loadu_si128(p + i), zero);
		simde__m128i b = simde_mm_sad_epu8(simde_mm_loadu_si128(p + i + 1), zero);
		simde__m128i c = simde_mm_sad_epu8(simde_mm_loadu_si128(p + i + 2), zero);
		simde__m128i d = simde_mm_sad_epu8(simde_mm_loadu_si128(p + i + 3), zero);

		even = simde_mm_add_epi64(even, simde_mm_add_epi64(a, b));
		odd = simde_mm_add_epi64(odd, simde_mm_add_epi64(c, d));
	}
	return simde_mm_cvtsi128_si64(simde_mm_add_epi64(even, odd));
}

/* Spots on a jittered grid of 12 by 10, as far as there are any left. */
static void draw_spots(struct picture *picture, int spot_count, double diameter_px, struct rng *rng)
{
	for (int i = 0; i < spot_count; i++) {
		struct true_spot spot = {
			.x_px = 60 + 100 * (i % 12) + 40 * rng_uniform(rng),
			.y_px = 40 + 95 * (i / 12 % 10) + 40 * rng_uniform(rng),
			.diameter_px = diameter_px,
			.axis_ratio = 1,
			.psf_px = 0.8,
			.amplitude = 50 + 180 * rng_uniform(rng),
		};

		picture_add(picture, &spot, 2);
	}
}

static void fill_pool(uint8_t *pool, int spot_count, double diameter_px)
{
	struct rng rng;

	rng_init(&rng, 1, 1);
	for (size_t i = 0; i < PICTURE_COUNT; i++) {
		struct picture picture = picture_create(WIDTH, HEIGHT, 10);

		draw_spots(&picture, spot_count, diameter_px, &rng);
		picture_expose(&picture, 2, &rng);
		for (size_t f = i; f < FRAME_COUNT; f += PICTURE_COUNT)
			memcpy(pool + f * FRAME_BYTES, picture.pixels, FRAME_BYTES);
		picture_destroy(&picture);
	}
}

static int compare(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

static double median(double *values, size_t count)
{
	qsort(values, count, sizeof(*values), compare);
	return values[count / 2];
}

int main(int argc, char **argv)
{
	static double read_us[FRAME_COUNT * ROUND_COUNT], find_us[FRAME_COUNT * ROUND_COUNT];
	static double ratio[FRAME_COUNT * ROUND_COUNT];
	int spot_count = argc > 1 ? atoi(argv[1]) : 110;
	double diameter_px = argc > 2 ? atof(argv[2]) : 3;
	struct blob_settings settings = blob_settings_default();
	uint8_t *pool = aligned_alloc(4096, FRAME_COUNT * FRAME_BYTES);
	static struct blob_set set;
	struct blob_finder *finder;
	volatile int64_t sum = 0; /* so that reading is not optimised away */
	size_t n = 0;

	if (!pool || blob_finder_create(&finder, WIDTH, HEIGHT, &settings))
		return 1;
	fill_pool(pool, spot_count, diameter_px);
	for (int round = 0; round < ROUND_COUNT; round++)
		for (size_t f = 0; f < FRAME_COUNT; f++, n++) {
			size_t other = (f + FRAME_COUNT / 2) % FRAME_COUNT;
			struct grey_image image = {pool + other * FRAME_BYTES, WIDTH, HEIGHT,
						   WIDTH};
			int64_t start_ns = clock_now_ns(), middle_ns;

			sum += sum_frame(pool + f * FRAME_BYTES);
			middle_ns = clock_now_ns();
			blob_finder_run(finder, &image, &set);
			read_us[n] = (double)(middle_ns - start_ns) / 1e3;
			find_us[n] = (double)(clock_now_ns() - middle_ns) / 1e3;
			ratio[n] = find_us[n] / read_us[n];
		}
	printf("{\"spots\":%d,\"diameter_px\":%g,\"blobs\":%u,\"read_us\":%.1f,\"find_us\":%.1f,"
	       "\"ratio\":%.3f}\n",
	       spot_count, diameter_px, set.blob_count, median(read_us, n), median(find_us, n),
	       median(ratio, n));
	blob_finder_destroy(finder);
	free(pool);
	return 0;
}
