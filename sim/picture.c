/*
 * Without its strobe's light, another shot's light, or the light of three shots in one.
 */
#include "sim/picture.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "sim/render/hd_render.h"
#include "sim/render/noise.h"
#include "sim/render/noise_patterned.h"
#include "sim/render/optics.h"
#include "sim/world/scene_parts.h"

#define LEAK_GREY 12

struct sim_picture {
	struct sim_renderer *renderer;       /* owned; NULL for HD */
	struct sim_hd_renderer *hd_renderer; /* owned; NULL for IR */
	size_t size_bytes;
	uint8_t *black; /* owned; of an HD frame without light */
	uint8_t *sum;   /* owned; of several shots */
};

int sim_picture_create(struct sim_picture **out, const struct sim_scene *scene, uint32_t camera,
		       enum sim_noise noise)
{
	struct sim_picture *picture = calloc(1, sizeof(*picture));
	const struct sim_camera *model = &scene->cameras[camera];
	int err;

	if (!picture)
		return -ENOMEM;
	if (camera >= scene->camera_count)
		err = sim_hd_renderer_create(&picture->hd_renderer, scene, camera);
	else
		err = sim_renderer_create(&picture->renderer, scene, camera, noise);
	picture->size_bytes = (size_t)model->width_px * (size_t)model->height_px;
	picture->black = calloc(1, picture->size_bytes);
	picture->sum = calloc(1, picture->size_bytes);
	if (err || !picture->black || !picture->sum) {
		sim_picture_destroy(picture);
		return -ENOMEM;
	}
	*out = picture;
	return 0;
}

double sim_picture_electrons_per_grey(const struct sim_scene *scene)
{
	return scene->script.optics == SIM_OPTICS_TAILED ? PATTERNED_ELECTRONS_PER_GREY
							 : SENSOR_ELECTRONS_PER_GREY;
}

void sim_picture_destroy(struct sim_picture *picture)
{
	if (!picture)
		return;
	sim_renderer_destroy(picture->renderer);
	sim_hd_renderer_destroy(picture->hd_renderer);
	free(picture->black);
	free(picture->sum);
	free(picture);
}

static const uint8_t *render(struct sim_picture *picture, uint64_t shot, int *width_px,
			     int *height_px)
{
	return picture->renderer ? sim_render(picture->renderer, shot, width_px, height_px)
				 : sim_hd_render(picture->hd_renderer, shot, width_px, height_px);
}

static const uint8_t *render_dark(struct sim_picture *picture, uint64_t shot, int *width_px,
				  int *height_px)
{
	if (picture->renderer)
		return sim_render_unlit(picture->renderer, shot, width_px, height_px);
	render(picture, shot, width_px, height_px); /* for its size */
	return picture->black;
}

static void add(uint8_t *sum, const uint8_t *more, size_t size_bytes)
{
	for (size_t i = 0; i < size_bytes; i++) {
		unsigned both = (unsigned)sum[i] + more[i];

		sum[i] = (uint8_t)(both > 255 ? 255 : both);
	}
}

/* The strobes of the shots before and behind it too. */
static const uint8_t *expose_long(struct sim_picture *picture, uint64_t shot, int *width_px,
				  int *height_px)
{
	memcpy(picture->sum, render(picture, shot, width_px, height_px), picture->size_bytes);
	add(picture->sum, render(picture, shot > 0 ? shot - 1 : 0, width_px, height_px),
	    picture->size_bytes);
	add(picture->sum, render(picture, shot + 1, width_px, height_px), picture->size_bytes);
	return picture->sum;
}

/* An HD camera without a filter against the strobes' light. */
static const uint8_t *leak(struct sim_picture *picture, const uint8_t *pixels)
{
	memset(picture->sum, LEAK_GREY, picture->size_bytes);
	add(picture->sum, pixels, picture->size_bytes);
	return picture->sum;
}

const uint8_t *sim_picture_take(struct sim_picture *picture, uint64_t shot, sim_fault_mask faults,
				bool strobes_lit, int *width_px, int *height_px)
{
	const uint8_t *pixels;

	if (faults & SIM_FAULT_BIT(SIM_FAULT_PHASE_SLIP))
		shot++;
	if ((faults & SIM_FAULT_BIT(SIM_FAULT_SHIFT)) && shot > 0)
		shot--;
	if (!strobes_lit && picture->renderer)
		return sim_render_dark(picture->renderer, shot, width_px, height_px);
	if (faults & SIM_FAULT_BIT(SIM_FAULT_DARK))
		pixels = render_dark(picture, shot, width_px, height_px);
	else if (faults & SIM_FAULT_BIT(SIM_FAULT_STUCK_EXPOSURE))
		pixels = expose_long(picture, shot, width_px, height_px);
	else
		pixels = render(picture, shot, width_px, height_px);
	if (strobes_lit && (faults & SIM_FAULT_BIT(SIM_FAULT_STROBE_LEAK)))
		pixels = leak(picture, pixels);
	return pixels;
}
