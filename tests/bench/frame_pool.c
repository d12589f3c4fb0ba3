/*
 * Frames from the simulator's full-noise renderer.
 */
#include "tests/bench/frame_pool.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <simde/x86/sse2.h>

#include "sim/render/render.h"
#include "sim/world/scene.h"

#define FRAMES_MIN 8
#define STEP_RATE_HZ 1000
#define FIRST_STEP 1500 /* well into speech */

static int frames_for_cache(size_t frame_bytes)
{
	long cache_bytes = sysconf(_SC_LEVEL3_CACHE_SIZE);
	long wanted = cache_bytes > 0 ? 5 * cache_bytes / 2 / POOL_CAMERAS : 0;
	long count = wanted / (long)frame_bytes + 1;

	return count > FRAMES_MIN ? (int)count : FRAMES_MIN;
}

static int render(struct frame_pool *pool, struct sim_renderer *renderer)
{
	const uint8_t *pixels = sim_render(renderer, FIRST_STEP, &pool->width_px, &pool->height_px);
	size_t bytes = (size_t)pool->width_px * (size_t)pool->height_px;

	pool->frame_count = frames_for_cache(bytes);
	pool->pixels = aligned_alloc(64, bytes * (size_t)pool->frame_count);
	if (!pool->pixels)
		return -ENOMEM;
	for (int i = 0; i < pool->frame_count; i++) {
		pixels = sim_render(renderer, FIRST_STEP + (uint64_t)i, &pool->width_px,
				    &pool->height_px);
		memcpy(pool->pixels + (size_t)i * bytes, pixels, bytes);
	}
	return 0;
}

int frame_pool_init(struct frame_pool *pool, uint64_t seed, uint32_t camera)
{
	struct sim_options options = {
		.seed = seed, .camera_count = POOL_CAMERAS, .rate_hz = STEP_RATE_HZ};
	struct sim_renderer *renderer = NULL;
	struct sim_scene *scene = NULL;
	int err = sim_scene_create(&scene, &options, NULL);

	memset(pool, 0, sizeof(*pool));
	if (!err)
		err = sim_renderer_create(&renderer, scene, camera, SIM_NOISE_FULL);
	if (!err)
		err = render(pool, renderer);
	sim_renderer_destroy(renderer);
	sim_scene_destroy(scene);
	return err;
}

void frame_pool_finish(struct frame_pool *pool)
{
	free(pool->pixels);
	memset(pool, 0, sizeof(*pool));
}

const uint8_t *frame_pool_at(const struct frame_pool *pool, uint64_t frame)
{
	uint64_t turn = 2 * (uint64_t)pool->frame_count - 2, place = frame % turn;

	if (place >= (uint64_t)pool->frame_count)
		place = turn - place;
	return pool->pixels + place * (size_t)pool->width_px * (size_t)pool->height_px;
}

uint64_t frame_pool_next(int64_t now_ns, int64_t *due_ns)
{
	int64_t frame = now_ns / POOL_PERIOD_NS + 1;

	*due_ns = frame * POOL_PERIOD_NS;
	return (uint64_t)frame;
}

uint64_t frame_pool_sum(const struct frame_pool *pool, uint64_t frame)
{
	const uint8_t *pixels = frame_pool_at(pool, frame);
	size_t bytes = (size_t)pool->width_px * (size_t)pool->height_px;
	simde__m128i zero = simde_mm_setzero_si128(), sums[4] = {zero, zero, zero, zero};

	for (size_t i = 0; i + 64 <= bytes; i += 64)
		for (size_t k = 0; k < 4; k++)
			sums[k] = simde_mm_add_epi64(
				sums[k],
				simde_mm_sad_epu8(
					simde_mm_load_si128(
						(const simde__m128i *)(const void *)(pixels + i +
										     16 * k)),
					zero));
	simde__m128i all = simde_mm_add_epi64(simde_mm_add_epi64(sums[0], sums[1]),
					      simde_mm_add_epi64(sums[2], sums[3]));
	return (uint64_t)simde_mm_cvtsi128_si64(all) +
	       (uint64_t)simde_mm_cvtsi128_si64(simde_mm_unpackhi_epi64(all, all));
}
