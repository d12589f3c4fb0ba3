/*
 * Row by row: what the board sends, what it hides, and the sensor's noise on both.
 */
#include "sim/board/board_picture.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "sim/world/scene_parts.h"

struct board_picture {
	/* set when made */
	const struct sim_scene *scene; /* borrowed */
	uint32_t camera;
	struct board_paper paper;
	struct board_art art;
	/* owned by the thread that draws */
	struct board_view view;
	float *light, *cover; /* owned; of a row */
};

int board_picture_create(struct board_picture **out, const struct sim_scene *scene, uint32_t camera,
			 double blur_sigma_px, const struct board_paper *paper)
{
	const struct sim_camera *model = &scene->cameras[camera];
	struct board_picture *picture = calloc(1, sizeof(*picture));

	if (!picture)
		return -ENOMEM;
	picture->scene = scene;
	picture->camera = camera;
	picture->paper = *paper;
	picture->light = calloc((size_t)model->width_px, sizeof(float));
	picture->cover = calloc((size_t)model->width_px, sizeof(float));
	if (!picture->light || !picture->cover || board_art_init(&picture->art, &scene->board)) {
		board_picture_destroy(picture);
		return -ENOMEM;
	}
	board_view_init(&picture->view, &scene->board, &picture->art, model, blur_sigma_px,
			model->range_m);
	*out = picture;
	return 0;
}

void board_picture_destroy(struct board_picture *picture)
{
	if (!picture)
		return;
	free(picture->light);
	free(picture->cover);
	free(picture);
}

static void expose_row(struct board_picture *picture, int y, const struct sensor *sensor,
		       struct rng *rng, uint8_t *row)
{
	const struct pixel_window *box = &picture->view.box;
	const float *paper = picture->paper.grey[y & 1];
	float *light = picture->light;

	board_view_row(&picture->view, y, light, picture->cover);
	for (int x = 0; x < box->x1 - box->x0; x++) {
		light[x] *= paper[(box->x0 + x) & 1];
		if (picture->paper.covers)
			light[x] += (1 - picture->cover[x]) * row[x];
	}
	sensor_expose(sensor, rng, box->x0, y, light, row, (size_t)(box->x1 - box->x0));
}

struct pixel_window board_picture_draw(struct board_picture *picture, uint64_t shot,
				       const struct sensor *sensor, struct rng *rng, uint8_t *image)
{
	const struct sim_camera *camera = picture->view.camera;
	struct exposure exposure = scene_exposure(picture->scene, picture->camera, shot);
	const struct pixel_window *box = &picture->view.box;

	board_view_begin(&picture->view, &exposure);
	for (int y = box->y0; y < box->y1; y++)
		expose_row(picture, y, sensor, rng,
			   image + (size_t)y * (size_t)camera->width_px + box->x0);
	return *box;
}
