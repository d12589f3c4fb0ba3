/*
 * Greedy: the pose that adds most to what is known so far, again and again.
 */
#include "calib/board/choose.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COLUMNS 12
#define ROWS 8
#define LINK_WORTH 20.0 /* corners that a new link of two cameras counts for */

enum state { OPEN, NEAR, TAKEN };

struct pose_views {
	uint32_t first, count; /* of the observations' views */
};

struct choosing {
	const struct observations *all;
	uint32_t pose_count, taken_count;
	struct pose_views *poses; /* owned */
	uint8_t *state;           /* owned; enum state, per pose */
	uint32_t cells[CAMERA_MAX][ROWS][COLUMNS];
	uint32_t links[CAMERA_MAX][CAMERA_MAX];
};

static void list_poses(struct choosing *c)
{
	const struct observations *o = c->all;

	for (uint32_t v = 0; v < o->view_count; v++) {
		if (v == 0 || o->views[v].pose != o->views[v - 1].pose)
			c->poses[c->pose_count++] = (struct pose_views){v, 0};
		c->poses[c->pose_count - 1].count++;
	}
}

/* Has camera and corners of view a, at most `near_px` apart in the mean. */
static bool is_near(const struct observations *o, uint32_t a, uint32_t b, double near_part)
{
	const double(*pa)[2] = observations_px(o, a), (*pb)[2] = observations_px(o, b);
	double near_px = near_part * o->cameras[o->views[a].camera].width_px, sum = 0;
	uint32_t count = 0;

	for (uint32_t i = 0; i < o->corner_count; i++) {
		double moved_px = hypot(pa[i][0] - pb[i][0], pa[i][1] - pb[i][1]);

		if (isnan(moved_px))
			continue;
		if (moved_px > 4 * near_px)
			return false;
		sum += moved_px;
		count++;
	}
	return 2 * count > o->views[a].seen_count && sum <= near_px * count;
}

/* All that pose a shows is in pose b as well. */
static bool is_duplicate(const struct choosing *c, uint32_t a, uint32_t b, double near_part)
{
	const struct pose_views *pa = &c->poses[a], *pb = &c->poses[b];
	const struct observed_view *views = c->all->views;

	for (uint32_t i = pa->first; i < pa->first + pa->count; i++) {
		bool found = false;

		for (uint32_t k = pb->first; !found && k < pb->first + pb->count; k++)
			found = views[i].camera == views[k].camera &&
				is_near(c->all, i, k, near_part);
		if (!found)
			return false;
	}
	return true;
}

static uint32_t leave_near(struct choosing *c, double near_part)
{
	uint32_t near_count = 0;

	for (uint32_t a = 0; a < c->pose_count; a++)
		for (uint32_t b = 0; b < a && c->state[a] == OPEN; b++)
			if (c->state[b] == OPEN && is_duplicate(c, a, b, near_part)) {
				c->state[a] = NEAR;
				near_count++;
			}
	return near_count;
}

static uint32_t *cell_of(struct choosing *c, uint32_t camera, const double px[2])
{
	const struct observed_camera *k = &c->all->cameras[camera];
	int x = (int)((px[0] + 0.5) / k->width_px * COLUMNS);
	int y = (int)((px[1] + 0.5) / k->height_px * ROWS);

	return &c->cells[camera][y < ROWS ? y : ROWS - 1][x < COLUMNS ? x : COLUMNS - 1];
}

/* What a pose would add; `take` adds it. */
static double worth_of(struct choosing *c, uint32_t pose, bool take)
{
	const struct observations *o = c->all;
	const struct pose_views *p = &c->poses[pose];
	double worth = 0;

	for (uint32_t v = p->first; v < p->first + p->count; v++) {
		const double(*px)[2] = observations_px(o, v);
		uint32_t camera = o->views[v].camera;

		for (uint32_t i = 0; i < o->corner_count; i++) {
			if (isnan(px[i][0]))
				continue;
			uint32_t *cell = cell_of(c, camera, px[i]);
			worth += 1.0 / (1 + *cell);
			*cell += take;
		}
		for (uint32_t w = p->first; w < v; w++) {
			uint32_t *link = &c->links[o->views[w].camera][camera];

			worth += LINK_WORTH / (1 + *link);
			*link += take;
		}
	}
	return worth;
}

static void take_best(struct choosing *c)
{
	uint32_t best = UINT32_MAX;
	double most = -1;

	for (uint32_t n = 0; n < c->pose_count; n++) {
		double worth = c->state[n] == OPEN ? worth_of(c, n, false) : -1;

		if (worth > most) {
			most = worth;
			best = n;
		}
	}
	worth_of(c, best, true);
	c->state[best] = TAKEN;
	c->taken_count++;
}

static bool is_taken(const struct observed_view *view, uint32_t nth_pose, const void *user)
{
	(void)view;
	return ((const struct choosing *)user)->state[nth_pose] == TAKEN;
}

int observations_choose(struct observations *chosen, const struct observations *all,
			const struct choose_settings *settings, uint32_t *near_count)
{
	struct choosing *c = calloc(1, sizeof(*c));
	int err = -ENOMEM;

	if (!c)
		return -ENOMEM;
	c->all = all;
	c->poses = calloc(all->view_count + 1, sizeof(*c->poses));
	c->state = calloc(all->view_count + 1, sizeof(*c->state));
	if (!c->poses || !c->state)
		goto done;
	list_poses(c);
	uint32_t near = leave_near(c, settings->near_part);
	uint32_t left = c->pose_count - near;
	while (c->taken_count < left && c->taken_count < settings->poses_max)
		take_best(c);
	err = observations_select(chosen, all, is_taken, c);
	if (!err)
		*near_count = near;
done:
	free(c->poses);
	free(c->state);
	free(c);
	return err;
}
