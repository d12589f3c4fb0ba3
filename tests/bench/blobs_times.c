/*
 * What finding blobs costs: on frames from a pool larger than twice the last-level cache, in turn
 * with plainly reading them and with OpenCV, so that load on the machine meets all alike.
 */
#include <errno.h>
#include <simde/x86/sse2.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "tests/bench/blobs.h"
#include "tests/bench/blobs_opencv.h"
#include "tests/unit/track_blobs_spots.h"
#include "track/blobs/blobs.h"

#define WIDTH 1280
#define HEIGHT 1024
#define FRAME_BYTES ((size_t)WIDTH * HEIGHT)
#define FRAMES_MIN 64
#define PICTURE_COUNT 4 /* different ones among them */
#define ROUNDS 10       /* over all frames, times the effort */
#define OPENCV_EVERY 16 /* frames: it takes long */
#define OPENCV_THRESHOLD (BENCH_BACKGROUND + 6 * BENCH_READ_NOISE)

enum job { JOB_READ, JOB_FIND, JOB_CONTOURS, JOB_COMPONENTS, JOB_COUNT };

struct times {
	uint8_t *pool;
	size_t frame_count;
	struct blob_finder *finder;
	struct blob_set set;
	int64_t read_sum; /* so that reading is not optimised away */
	size_t sample_count[JOB_COUNT];
	double *samples_us[JOB_COUNT];
};

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

		picture_add(picture, &spot, BENCH_READ_NOISE);
	}
}

static void fill_pool(struct times *times, uint64_t seed, int spot_count, double diameter_px)
{
	struct rng rng;

	rng_init(&rng, seed, 1);
	for (size_t i = 0; i < PICTURE_COUNT; i++) {
		struct picture picture = picture_create(WIDTH, HEIGHT, BENCH_BACKGROUND);

		draw_spots(&picture, spot_count, diameter_px, &rng);
		picture_expose(&picture, BENCH_READ_NOISE, &rng);
		for (size_t f = i; f < times->frame_count; f += PICTURE_COUNT)
			memcpy(times->pool + f * FRAME_BYTES, picture.pixels, FRAME_BYTES);
		picture_destroy(&picture);
	}
}

static void do_job(struct times *times, enum job job, const uint8_t *frame)
{
	struct grey_image image = {frame, WIDTH, HEIGHT, WIDTH, 8};

	switch (job) {
	case JOB_READ:
		times->read_sum += sum_frame(frame);
		break;
	case JOB_FIND:
		blob_finder_run(times->finder, &image, &times->set);
		break;
	case JOB_CONTOURS:
		opencv_contours(frame, WIDTH, HEIGHT, OPENCV_THRESHOLD);
		break;
	default:
		opencv_components(frame, WIDTH, HEIGHT, OPENCV_THRESHOLD);
	}
}

/* Every job its own frame; reading and finding half a turn apart, so that both meet a frame that
 * was in no cache for as long. */
static void time_jobs(struct times *times, size_t round, enum job last)
{
	static const size_t quarter_turns[JOB_COUNT] = {0, 2, 1, 3};

	for (enum job job = 0; job <= last; job++) {
		size_t frame = (round + quarter_turns[job] * times->frame_count / JOB_COUNT) %
			       times->frame_count;
		int64_t start_ns = clock_now_ns();

		do_job(times, job, times->pool + frame * FRAME_BYTES);
		times->samples_us[job][times->sample_count[job]++] =
			(double)(clock_now_ns() - start_ns) / 1e3;
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

/* Median of the rounds' own ratios: both of one were timed in the same moment. */
static double median_ratio(const struct times *times, enum job job, enum job of)
{
	size_t count = times->sample_count[job];
	double *ratios = calloc(count, sizeof(*ratios)), middle = 0;
	size_t stride = times->sample_count[of] / count;

	if (!ratios)
		return 0;
	for (size_t i = 0; i < count; i++)
		ratios[i] = times->samples_us[job][i] / times->samples_us[of][i * stride];
	middle = median(ratios, count);
	free(ratios);
	return middle;
}

static void run_rounds(struct times *times, int effort, bool with_opencv)
{
	size_t rounds = ROUNDS * (size_t)effort * times->frame_count;

	memset(times->sample_count, 0, sizeof(times->sample_count));
	for (size_t r = 0; r < rounds; r++)
		time_jobs(times, r,
			  with_opencv && r % OPENCV_EVERY == 0 ? JOB_COMPONENTS : JOB_FIND);
}

static int times_init(struct times *times, int effort)
{
	struct blob_settings settings = blob_settings_default();
	long cache_bytes = sysconf(_SC_LEVEL3_CACHE_SIZE);
	size_t wanted = cache_bytes > 0 ? 5 * (size_t)cache_bytes / 2 / FRAME_BYTES + 1 : 0;

	times->frame_count = wanted > FRAMES_MIN ? wanted : FRAMES_MIN;
	times->pool = aligned_alloc(4096, times->frame_count * FRAME_BYTES);
	for (int j = 0; j < JOB_COUNT; j++) {
		times->samples_us[j] = calloc(ROUNDS * (size_t)effort * times->frame_count,
					      sizeof(*times->samples_us[j]));
		if (!times->samples_us[j])
			return -ENOMEM;
	}
	opencv_init(WIDTH, HEIGHT);
	return times->pool ? blob_finder_create(&times->finder, WIDTH, HEIGHT, &settings) : -ENOMEM;
}

static void times_finish(struct times *times)
{
	blob_finder_destroy(times->finder);
	for (int j = 0; j < JOB_COUNT; j++)
		free(times->samples_us[j]);
	free(times->pool);
	free(times);
}

static void tell(struct blobs_bench *bench, const char *name, double value)
{
	json_object_set_new(bench->figures, name, json_real(value));
}

static void measure(struct blobs_bench *bench, struct times *times)
{
	fill_pool(times, bench->seed, bench->spot_count, bench->diameter_px);
	run_rounds(times, bench->effort, true);
	tell(bench, "blob_time_over_read", median_ratio(times, JOB_FIND, JOB_READ));
	tell(bench, "opencv_contours_time_over_ours", median_ratio(times, JOB_CONTOURS, JOB_FIND));
	tell(bench, "opencv_components_time_over_ours",
	     median_ratio(times, JOB_COMPONENTS, JOB_FIND));
	tell(bench, "blob_read_us", median(times->samples_us[JOB_READ], times->sample_count[0]));
	tell(bench, "blob_find_us", median(times->samples_us[JOB_FIND], times->sample_count[1]));
	tell(bench, "blobs_found", times->set.blob_count);
	fill_pool(times, bench->seed + 1, 0, 1);
	run_rounds(times, bench->effort, false);
	tell(bench, "blob_time_over_read_dark", median_ratio(times, JOB_FIND, JOB_READ));
}

int bench_times(struct blobs_bench *bench)
{
	struct times *times = calloc(1, sizeof(*times));
	int err;

	if (!times)
		return -ENOMEM;
	err = times_init(times, bench->effort);
	if (!err)
		measure(bench, times);
	times_finish(times);
	return err;
}
