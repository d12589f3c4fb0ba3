/*
 * The truth's occluders, dressed.
 */
#include "sim/render/hd_figures.h"

#include <errno.h>
#include <stdlib.h>

#include "sim/world/scene_parts.h"

#define BAND_ROWS 16 /* drawn as of one time where the shutter rolls */
#define HAND_RADIUS_M 0.14
#define PAINT_SEED 77

static const uint8_t CLOTHES[][HD_COLOURS] = {{30, 34, 48}, {46, 30, 30}, {30, 44, 36},
					      {48, 44, 34}, {40, 32, 46}, {34, 42, 46}};
static const uint8_t BARE[HD_COLOURS] = {68, 50, 42}, PASSER[HD_COLOURS] = {26, 26, 28};
static const struct vec3 LIGHT = {0.25, 0.80, 0.55}; /* from the cameras' side, above */

/* Of the head: a neck is no truth, it only keeps the head from floating. */
static const struct vec3 NECK_M = {0, -0.165, -0.025}, NECK_AXES_M = {0.055, 0.09, 0.057};

enum { NECK_OF = 1 << 16 }; /* figure: NECK_OF + actor, or an occluder's index */

struct figure {
	uint32_t what;
	double away_m;
};

struct hd_figures {
	/* set when made */
	const struct sim_scene *scene;          /* borrowed */
	struct hd_paint *paints[SIM_ACTOR_MAX]; /* owned */
	/* owned by the thread that draws */
	uint32_t count;
	struct figure figures[HD_FIGURE_MAX];
};

int hd_figures_create(struct hd_figures **out, const struct sim_scene *scene)
{
	struct hd_figures *figures = calloc(1, sizeof(*figures));

	if (!figures)
		return -ENOMEM;
	figures->scene = scene;
	for (uint32_t a = 0; a < scene->actor_count; a++) {
		figures->paints[a] = malloc(sizeof(*figures->paints[a]));
		if (!figures->paints[a]) {
			hd_figures_destroy(figures);
			return -ENOMEM;
		}
		hd_paint_init(figures->paints[a], scene->seed + PAINT_SEED * a);
	}
	*out = figures;
	return 0;
}

void hd_figures_destroy(struct hd_figures *figures)
{
	for (uint32_t a = 0; figures && a < SIM_ACTOR_MAX; a++)
		free(figures->paints[a]);
	free(figures);
}

/* The actor whose head, nose or flesh that occluder is; SIM_ACTOR_MAX: nobody's. */
static uint32_t actor_of(const struct sim_scene *scene, uint32_t occluder)
{
	for (uint32_t a = 0; a < scene->actor_count; a++) {
		const struct scene_actor *actor = &scene->actors[a];
		uint32_t count = actor->has_body ? 2 + SEGMENT_COUNT : 2;

		if (occluder >= actor->first_occluder && occluder < actor->first_occluder + count)
			return a;
	}
	return SIM_ACTOR_MAX;
}

/* Kept sorted, the farthest first; qsort() would allocate. */
static void add_figure(struct hd_figures *figures, uint32_t what, double away_m)
{
	uint32_t place = figures->count++;

	for (; place > 0 && figures->figures[place - 1].away_m < away_m; place--)
		figures->figures[place] = figures->figures[place - 1];
	figures->figures[place] = (struct figure){what, away_m};
}

/* Noses are painted; a neck is just behind its head. */
static void arrange(struct hd_figures *figures, const struct sim_truth *truth,
		    const struct sim_camera *camera)
{
	figures->count = 0;
	for (uint32_t i = 0; i < truth->occluder_count; i++) {
		uint32_t a = actor_of(figures->scene, i);
		uint32_t part =
			a < SIM_ACTOR_MAX ? i - figures->scene->actors[a].first_occluder : 0;
		double away_m =
			vec3_distance(truth->occluders[i].centre_stage_m, camera->centre_stage_m);

		if (a < SIM_ACTOR_MAX && part == 0)
			add_figure(figures, NECK_OF + a, away_m + 1e-3);
		if (a == SIM_ACTOR_MAX || part != 1)
			add_figure(figures, i, away_m);
	}
}

/* The unit sphere of a skull gives its head's axes. */
static struct sim_truth_occluder neck_below(const struct sim_truth_occluder *skull,
					    const struct ellipsoid *shape)
{
	const double skull_axes_m[3] = {shape->axes_m.x, shape->axes_m.y, shape->axes_m.z};
	const double neck_axes_m[3] = {NECK_AXES_M.x, NECK_AXES_M.y, NECK_AXES_M.z};
	struct vec3 from_skull = vec3_sub(NECK_M, shape->centre_m);
	const double offset_m[3] = {from_skull.x, from_skull.y, from_skull.z};
	struct sim_truth_occluder neck = {.centre_stage_m = skull->centre_stage_m,
					  .radius_m = NECK_AXES_M.y};

	for (int k = 0; k < 3; k++) {
		struct vec3 axis = {skull->to_unit[k][0], skull->to_unit[k][1],
				    skull->to_unit[k][2]};

		axis = vec3_scale(axis, skull_axes_m[k]);
		neck.centre_stage_m = vec3_add(neck.centre_stage_m, vec3_scale(axis, offset_m[k]));
		neck.to_unit[k][0] = axis.x / neck_axes_m[k];
		neck.to_unit[k][1] = axis.y / neck_axes_m[k];
		neck.to_unit[k][2] = axis.z / neck_axes_m[k];
	}
	return neck;
}

static struct sim_truth_occluder solid_of(const struct hd_figures *figures,
					  const struct sim_rolling *rolling, uint32_t what,
					  double row)
{
	if (what < NECK_OF)
		return sim_rolling_occluder(rolling, what, row);
	const struct scene_actor *actor = &figures->scene->actors[what - NECK_OF];
	struct sim_truth_occluder skull = sim_rolling_occluder(rolling, actor->first_occluder, row);

	return neck_below(&skull, &actor->face.skull);
}

static void set_colour(struct hd_coat *coat, const uint8_t colour[HD_COLOURS])
{
	for (int k = 0; k < HD_COLOURS; k++)
		coat->colour[k] = colour[k];
}

static void put_face(const struct hd_figures *figures, const struct sim_truth *truth, uint32_t a,
		     struct hd_coat *coat)
{
	const struct sim_truth_actor *actor = &truth->actors[a];
	double half_height_m = figures->scene->actors[a].face.skull.axes_m.y;

	coat->paint = figures->paints[a];
	coat->mood = (struct hd_mood){(float)(actor->lips_parted_m / half_height_m),
				      {(float)actor->lids_closed[0], (float)actor->lids_closed[1]}};
}

static struct hd_coat coat_of(const struct hd_figures *figures, const struct sim_truth *truth,
			      uint32_t what)
{
	uint32_t a = what >= NECK_OF ? what - NECK_OF : actor_of(figures->scene, what);
	struct hd_coat coat = {0};

	if (what >= NECK_OF)
		for (int k = 0; k < HD_COLOURS; k++)
			coat.colour[k] = figures->paints[a]->lid[k];
	else if (a == SIM_ACTOR_MAX)
		set_colour(&coat, truth->occluders[what].radius_m < HAND_RADIUS_M ? BARE : PASSER);
	else if (what == figures->scene->actors[a].first_occluder)
		put_face(figures, truth, a, &coat);
	else
		set_colour(&coat, CLOTHES[a % (sizeof(CLOTHES) / sizeof(CLOTHES[0]))]);
	return coat;
}

/* The unit sphere is not much of a stretched one: its normal will do. */
static void set_light(struct hd_coat *coat, const struct sim_truth_occluder *solid)
{
	struct vec3 light = LIGHT;

	for (int k = 0; k < 3; k++) {
		const double *axis = solid->to_unit[k];
		double norm = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);

		coat->light[k] =
			(float)((axis[0] * light.x + axis[1] * light.y + axis[2] * light.z) / norm);
	}
}

static void join(struct pixel_window *all, const struct pixel_window *more)
{
	if (pixel_window_count(more) == 0)
		return;
	if (pixel_window_count(all) == 0)
		*all = *more;
	all->x0 = more->x0 < all->x0 ? more->x0 : all->x0;
	all->y0 = more->y0 < all->y0 ? more->y0 : all->y0;
	all->x1 = more->x1 > all->x1 ? more->x1 : all->x1;
	all->y1 = more->y1 > all->y1 ? more->y1 : all->y1;
}

static struct pixel_window draw_figure(const struct hd_figures *figures,
				       const struct sim_rolling *rolling,
				       const struct sim_camera *camera, uint32_t what,
				       struct hd_canvas *canvas)
{
	struct hd_coat coat = coat_of(figures, &rolling->at[1], what);
	int rows = camera->height_px, step = rolling->rolls ? BAND_ROWS : rows + 1;
	struct pixel_window covered = {0};

	for (int y = 0; y < rows; y += step) {
		double middle = fmin(y + 0.5 * step, rows - 1);
		struct sim_truth_occluder solid = solid_of(figures, rolling, what, middle);
		struct hd_sight sight;

		if (!hd_sight_find(&sight, camera, &solid))
			continue;
		set_light(&coat, &solid);
		struct pixel_window band = hd_solid_draw(&sight, &coat, y, y + step, canvas);

		join(&covered, &band);
	}
	return covered;
}

uint32_t hd_figures_draw(struct hd_figures *figures, const struct sim_rolling *rolling,
			 const struct sim_camera *camera, struct hd_canvas *canvas,
			 struct pixel_window covered[HD_FIGURE_MAX])
{
	uint32_t count = 0;

	arrange(figures, &rolling->at[1], camera);
	for (uint32_t i = 0; i < figures->count; i++) {
		covered[count] =
			draw_figure(figures, rolling, camera, figures->figures[i].what, canvas);
		count += pixel_window_count(&covered[count]) > 0;
	}
	return count;
}
