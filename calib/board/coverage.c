/*
 * Corners per part of the image, tilts by pinhole, links by shared poses.
 */
#include "calib/board/coverage.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calib/board/homography.h"
#include "calib/board/plane_pose.h"
#include "calib/solve/seed.h"

#define TILTED_DEG 15.0
#define TILTED_MIN 2     /* views to each side */
#define REGIONS 3        /* of the image, per axis, for words */
#define REGION_PART 0.34 /* of a region's cells must have corners */
/* Of nine regions and four sides: a room's walls and cables keep the board out of some. */
#define ENOUGH_VIEWS 20
#define ENOUGH_REGIONS 7
#define ENOUGH_SIDES 3
#define DEGREES (180 / M_PI)

struct finding {
	const struct observations *o;
	double (*board_m)[2], (*px)[2]; /* owned */
};

static void count_cells(struct camera_coverage *camera, const struct observations *o, uint32_t v)
{
	const struct observed_camera *k = &o->cameras[o->views[v].camera];
	const double(*px)[2] = observations_px(o, v);

	for (uint32_t i = 0; i < o->corner_count; i++) {
		if (isnan(px[i][0]))
			continue;
		int x = (int)((px[i][0] + 0.5) / k->width_px * COVERAGE_COLUMNS);
		int y = (int)((px[i][1] + 0.5) / k->height_px * COVERAGE_ROWS);
		camera->cells[y < COVERAGE_ROWS ? y : COVERAGE_ROWS - 1]
			     [x < COVERAGE_COLUMNS ? x : COVERAGE_COLUMNS - 1]++;
	}
}

/* Pixels from the image's middle. */
static void take_px(struct finding *f, uint32_t v)
{
	const struct observed_camera *k = &f->o->cameras[f->o->views[v].camera];
	const double(*px)[2] = observations_px(f->o, v);

	for (uint32_t i = 0; i < f->o->corner_count; i++) {
		f->px[i][0] = px[i][0] - 0.5 * (k->width_px - 1);
		f->px[i][1] = px[i][1] - 0.5 * (k->height_px - 1);
	}
}

static bool find_focal(struct finding *f, uint32_t camera, double *focal_px)
{
	double half_px = 0.5 * f->o->cameras[camera].width_px, h[9];
	struct focal_sums sums = {0};

	for (uint32_t v = 0; v < f->o->view_count; v++) {
		if (f->o->views[v].camera != camera || f->o->views[v].seen_count < 4)
			continue;
		take_px(f, v);
		if (!homography_fit(h, (const double(*)[2])f->board_m, (const double(*)[2])f->px,
				    f->o->corner_count))
			focal_add(&sums, h, half_px);
	}
	return focal_from_sums(&sums, half_px, focal_px) == 0;
}

/* How far the board leans away from the line of sight, to which sides. */
static void count_tilt(struct camera_coverage *camera, const struct pose *rt_cam_board)
{
	struct vec3 sight = vec3_unit(rt_cam_board->t);
	struct vec3 n = {rt_cam_board->r[0][2], rt_cam_board->r[1][2], rt_cam_board->r[2][2]};
	double sideways_deg = (atan2(n.x, n.z) - atan2(sight.x, sight.z)) * DEGREES;
	double down_deg = (atan2(n.y, n.z) - atan2(sight.y, sight.z)) * DEGREES;
	double tilt_deg = acos(fmin(1, fabs(vec3_dot(n, sight)))) * DEGREES;

	camera->tilted[SIDE_LEFT] += sideways_deg < -TILTED_DEG;
	camera->tilted[SIDE_RIGHT] += sideways_deg > TILTED_DEG;
	camera->tilted[SIDE_UP] += down_deg < -TILTED_DEG;
	camera->tilted[SIDE_DOWN] += down_deg > TILTED_DEG;
	camera->tilt_deg = fmax(camera->tilt_deg, tilt_deg);
}

static void find_tilts(struct finding *f, struct camera_coverage *cameras, uint32_t camera)
{
	double focal_px, rms_px;
	struct pose pose;

	cameras[camera].tilt_deg = NAN;
	if (!find_focal(f, camera, &focal_px))
		return;
	for (uint32_t v = 0; v < f->o->view_count; v++) {
		if (f->o->views[v].camera != camera)
			continue;
		take_px(f, v);
		if (!plane_pose_fit(&pose, &rms_px, (const double(*)[2])f->board_m,
				    (const double(*)[2])f->px, f->o->corner_count, focal_px))
			count_tilt(&cameras[camera], &pose);
	}
}

static void count_links(struct camera_coverage *cameras, const struct observations *o)
{
	for (uint32_t v = 0; v < o->view_count; v++)
		for (uint32_t w = v; w-- > 0 && o->views[w].pose == o->views[v].pose;) {
			cameras[o->views[v].camera].links[o->views[w].camera]++;
			cameras[o->views[w].camera].links[o->views[v].camera]++;
		}
	for (uint32_t c = 0; c < o->camera_count; c++)
		for (uint32_t d = 0; d < o->camera_count; d++)
			cameras[c].linked += cameras[c].links[d] >= SEED_LINKS_MIN;
}

static void find_part(struct camera_coverage *camera)
{
	int filled = 0;

	for (int y = 0; y < COVERAGE_ROWS; y++)
		for (int x = 0; x < COVERAGE_COLUMNS; x++)
			filled += camera->cells[y][x] > 0;
	camera->part = filled / (double)(COVERAGE_ROWS * COVERAGE_COLUMNS);
}

int coverage_find(struct camera_coverage *cameras, const struct observations *o)
{
	struct finding f = {.o = o,
			    .board_m = calloc(o->corner_count, sizeof(*f.board_m)),
			    .px = calloc(o->corner_count, sizeof(*f.px))};
	int err = f.board_m && f.px ? 0 : -ENOMEM;

	if (err)
		goto done;
	memset(cameras, 0, o->camera_count * sizeof(*cameras));
	for (uint32_t i = 0; i < o->corner_count; i++) {
		struct vec3 p = board_corner_m(&o->board, (int)i);

		f.board_m[i][0] = p.x;
		f.board_m[i][1] = p.y;
	}
	for (uint32_t v = 0; v < o->view_count; v++) {
		cameras[o->views[v].camera].views++;
		count_cells(&cameras[o->views[v].camera], o, v);
	}
	for (uint32_t c = 0; c < o->camera_count; c++) {
		find_tilts(&f, cameras, c);
		find_part(&cameras[c]);
	}
	count_links(cameras, o);
done:
	free(f.board_m);
	free(f.px);
	return err;
}

static void add_word(char *words, const char *word)
{
	size_t length = strlen(words);

	snprintf(words + length, COVERAGE_WORDS_BYTES - length, "%s%s", length ? ", " : "", word);
}

/* Of the image's nine regions. */
static bool has_region(const struct camera_coverage *camera, int column, int row)
{
	const int wide = COVERAGE_COLUMNS / REGIONS, high = COVERAGE_ROWS / REGIONS;
	int filled = 0;

	for (int y = row * high; y < (row + 1) * high; y++)
		for (int x = column * wide; x < (column + 1) * wide; x++)
			filled += camera->cells[y][x] > 0;
	return filled >= REGION_PART * wide * high;
}

static const char *const region_names[REGIONS][REGIONS] = {
	{"upper left", "upper middle", "upper right"},
	{"left", "middle", "right"},
	{"lower left", "lower middle", "lower right"}};

static int region_at(double px, int size_px)
{
	int region = (int)floor((px + 0.5) / size_px * REGIONS);

	return region < 0 ? 0 : region >= REGIONS ? REGIONS - 1 : region;
}

const char *coverage_region_name(const struct observed_camera *camera, const double px[2])
{
	return region_names[region_at(px[1], camera->height_px)]
			   [region_at(px[0], camera->width_px)];
}

static int regions_filled(const struct camera_coverage *camera)
{
	int filled = 0;

	for (int y = 0; y < REGIONS; y++)
		for (int x = 0; x < REGIONS; x++)
			filled += has_region(camera, x, y);
	return filled;
}

static int sides_tilted(const struct camera_coverage *camera)
{
	int sides = 0;

	for (int s = 0; s < SIDE_COUNT; s++)
		sides += camera->tilted[s] >= TILTED_MIN;
	return sides;
}

bool coverage_enough(const struct camera_coverage *camera, bool alone)
{
	return camera->views >= ENOUGH_VIEWS && (camera->linked || alone) &&
	       regions_filled(camera) >= ENOUGH_REGIONS && sides_tilted(camera) >= ENOUGH_SIDES;
}

double coverage_progress(const struct camera_coverage *camera, bool alone)
{
	return (fmin(1, camera->views / (double)ENOUGH_VIEWS) + (camera->linked || alone) +
		fmin(1, regions_filled(camera) / (double)ENOUGH_REGIONS) +
		fmin(1, sides_tilted(camera) / (double)ENOUGH_SIDES)) /
	       4;
}

void coverage_missing(const struct camera_coverage *camera, bool alone,
		      char words[COVERAGE_WORDS_BYTES])
{
	static const char *const sides[SIDE_COUNT] = {"tilted left", "tilted right", "tilted up",
						      "tilted down"};

	words[0] = '\0';
	if (camera->views < SEED_VIEWS_MIN)
		add_word(words, "more views");
	if (!camera->linked && !alone)
		add_word(words, "views together with a neighbour");
	for (int y = 0; y < REGIONS; y++)
		for (int x = 0; x < REGIONS; x++)
			if (!has_region(camera, x, y))
				add_word(words, region_names[y][x]);
	for (int s = 0; s < SIDE_COUNT; s++)
		if (camera->tilted[s] < TILTED_MIN)
			add_word(words, sides[s]);
}
