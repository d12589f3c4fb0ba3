/*
 * A stage of fake cameras: made, started, stopped and counted together.
 */
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "sim/gige/gige_parts.h"

#define EPOCH_AHEAD_MAX_NS (NS_PER_S / 2) /* control waits while a camera waits for its pulse */

static int set_addresses(struct gige_stage *stage, const char *first_address, struct diag *diag)
{
	struct in_addr address;

	if (inet_pton(AF_INET, first_address, &address) != 1) {
		diag_add(diag, "first address '%s': not an IPv4 address, like 127.0.0.11",
			 first_address);
		return -EINVAL;
	}
	uint32_t first = ntohl(address.s_addr);

	if (first >> 24 != 127 || (first + stage->camera_count) >> 24 != 127) {
		diag_add(diag, "first address '%s': simulated cameras live in 127.0.0.0/8 only",
			 first_address);
		return -EINVAL;
	}
	for (uint32_t i = 0; i < stage->camera_count; i++) {
		address.s_addr = htonl(first + i);
		inet_ntop(AF_INET, &address, stage->cameras[i].address, INET_ADDRSTRLEN);
	}
	return 0;
}

static int create_renderers(struct gige_stage *stage)
{
	for (uint32_t i = 0; i < stage->camera_count; i++) {
		struct gige_camera *camera = &stage->cameras[i];
		int error = sim_renderer_create(&camera->renderer, stage->scene, i, SIM_NOISE_FAST);

		if (error)
			return error;
		camera->stage = stage;
		camera->index = i;
	}
	sim_render(stage->cameras[0].renderer, 0, &stage->width_px, &stage->height_px);
	return 0;
}

int gige_stage_create(struct gige_stage **out, const struct sim_scene *scene, int64_t epoch_ns,
		      const char *first_address, struct diag *diag)
{
	struct gige_stage *stage;
	int error = -ENOMEM;

	if (epoch_ns > clock_now_ns() + EPOCH_AHEAD_MAX_NS) {
		diag_add(diag,
			 "epoch %" PRId64 " ns: lies more than half a second ahead; start later, "
			 "or use an epoch in the past",
			 epoch_ns);
		return -EINVAL;
	}
	stage = calloc(1, sizeof(*stage));
	if (!stage)
		return -ENOMEM;
	stage->scene = scene;
	stage->epoch_ns = epoch_ns;
	stage->camera_count = sim_scene_camera_count(scene);
	error = set_addresses(stage, first_address, diag);
	if (!error)
		error = create_renderers(stage);
	if (error)
		goto fail;
	*out = stage;
	return 0;
fail:
	gige_stage_destroy(stage);
	return error;
}

void gige_stage_destroy(struct gige_stage *stage)
{
	if (!stage)
		return;
	gige_stage_stop(stage);
	for (uint32_t i = 0; i < stage->camera_count; i++)
		sim_renderer_destroy(stage->cameras[i].renderer);
	free(stage);
}

/* Of CLOCK_MONOTONIC; by the sharpest of some looks. */
static int64_t tai_ahead_ns(void)
{
	int64_t ahead_ns = 0, sharpest_ns = INT64_MAX;

	for (int i = 0; i < 20; i++) {
		struct timespec tai;
		int64_t before_ns = clock_now_ns();

		clock_gettime(CLOCK_TAI, &tai);
		int64_t took_ns = clock_now_ns() - before_ns;

		if (took_ns < sharpest_ns)
			ahead_ns = tai.tv_sec * NS_PER_S + tai.tv_nsec - before_ns - took_ns / 2;
		sharpest_ns = took_ns < sharpest_ns ? took_ns : sharpest_ns;
	}
	return ahead_ns;
}

int gige_stage_start(struct gige_stage *stage, const struct gige_abilities *abilities,
		     struct diag *diag)
{
	char xml_path[] = "/tmp/stage-sim-gige-XXXXXX";
	int error;

	stage->stopping = false;
	stage->abilities = *abilities;
	stage->master_ahead_ns = tai_ahead_ns() + abilities->master_ahead_ns;
	error = gige_write_genicam(stage, xml_path, diag);
	for (uint32_t i = 0; i < stage->camera_count && !error; i++)
		error = gige_start_camera(&stage->cameras[i], xml_path, diag);
	unlink(xml_path);
	if (error)
		gige_stage_stop(stage);
	return error;
}

void gige_stage_stop(struct gige_stage *stage)
{
	stage->stopping = true;
	for (uint32_t i = 0; i < stage->camera_count; i++) {
		g_clear_object(&stage->cameras[i].device);
		stage->cameras[i].registers = NULL;
	}
}

struct gige_counts gige_stage_counts(const struct gige_stage *stage)
{
	struct gige_counts counts = {0};

	for (uint32_t i = 0; i < stage->camera_count; i++) {
		counts.sent += stage->cameras[i].sent;
		counts.late += stage->cameras[i].late;
		counts.skipped += stage->cameras[i].skipped;
	}
	return counts;
}

void gige_stage_image_size(const struct gige_stage *stage, int *width_px, int *height_px)
{
	*width_px = stage->width_px;
	*height_px = stage->height_px;
}
