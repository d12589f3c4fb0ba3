/*
 * Views of a board, kept in order.
 */
#include "calib/board/observations.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SIZE_MIN_PX 32
#define SIZE_MAX_PX 32768

static int check_cameras(const struct observed_camera *cameras, uint32_t count, struct diag *diag)
{
	int err = 0;

	if (count < 1 || count > CAMERA_MAX) {
		diag_add(diag, "%u cameras: 1 to %d can be calibrated at once", count, CAMERA_MAX);
		return -EINVAL;
	}
	for (uint32_t c = 0; c < count; c++) {
		const struct observed_camera *camera = &cameras[c];

		if (camera->width_px < SIZE_MIN_PX || camera->height_px < SIZE_MIN_PX ||
		    camera->width_px > SIZE_MAX_PX || camera->height_px > SIZE_MAX_PX) {
			diag_add(diag, "camera %s: %dx%d is no size of an image", camera->name,
				 camera->width_px, camera->height_px);
			err = -EINVAL;
		}
		for (uint32_t other = 0; other < c; other++)
			if (!strcmp(camera->name, cameras[other].name)) {
				diag_add(diag, "camera %s is listed twice; give each its own name",
					 camera->name);
				err = -EINVAL;
			}
	}
	return err;
}

int observations_init(struct observations *observations, const struct board *board,
		      const struct observed_camera *cameras, uint32_t camera_count,
		      struct diag *diag)
{
	int err = board_check(board, "board", diag);

	if (!err)
		err = check_cameras(cameras, camera_count, diag);
	if (err)
		return err;
	memset(observations, 0, sizeof(*observations));
	observations->board = *board;
	observations->corner_count = (uint32_t)board_corner_count(board);
	observations->camera_count = camera_count;
	memcpy(observations->cameras, cameras, camera_count * sizeof(*cameras));
	return 0;
}

void observations_finish(struct observations *observations)
{
	free(observations->views);
	free(observations->px);
	memset(observations, 0, sizeof(*observations));
}

static int grow(struct observations *o)
{
	if (o->view_count < o->view_capacity)
		return 0;
	uint32_t capacity = o->view_capacity ? 2 * o->view_capacity : 64;
	struct observed_view *views = realloc(o->views, capacity * sizeof(*views));

	if (!views)
		return -ENOMEM;
	o->views = views;
	double(*px)[2] = realloc(o->px, (size_t)capacity * o->corner_count * sizeof(*px));
	if (!px)
		return -ENOMEM;
	o->px = px;
	o->view_capacity = capacity;
	return 0;
}

/* The first view that does not stand before (pose, camera). */
static uint32_t place_of(const struct observations *o, uint32_t camera, uint32_t pose)
{
	uint32_t low = 0, high = o->view_count;

	while (low < high) {
		uint32_t middle = (low + high) / 2;
		const struct observed_view *view = &o->views[middle];

		if (view->pose < pose || (view->pose == pose && view->camera < camera))
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

/* How many corners were seen, or -1 when one lies outside the image. */
static int count_seen(const struct observations *o, uint32_t camera, const double (*px)[2])
{
	double right = o->cameras[camera].width_px - 0.5;
	double bottom = o->cameras[camera].height_px - 0.5;
	int seen = 0;

	for (uint32_t i = 0; i < o->corner_count; i++) {
		if (isnan(px[i][0]) || isnan(px[i][1]))
			continue;
		if (!(px[i][0] >= -0.5 && px[i][0] <= right && px[i][1] >= -0.5 &&
		      px[i][1] <= bottom))
			return -1;
		seen++;
	}
	return seen;
}

int observations_add(struct observations *observations, uint32_t camera, uint32_t pose,
		     const double (*px)[2])
{
	struct observations *o = observations;
	uint32_t at = place_of(o, camera, pose);
	int seen = count_seen(o, camera, px);

	if (seen < 0)
		return -ERANGE;
	if (at < o->view_count && o->views[at].pose == pose && o->views[at].camera == camera)
		return -EEXIST;
	int err = grow(o);
	if (err)
		return err;
	size_t block = o->corner_count, behind = o->view_count - at;
	memmove(&o->views[at + 1], &o->views[at], behind * sizeof(*o->views));
	memmove(o->px + (at + 1) * block, o->px + at * block, behind * block * sizeof(*px));
	memcpy(o->px + at * block, px, block * sizeof(*px));
	o->views[at] = (struct observed_view){camera, pose, (uint32_t)seen};
	o->view_count++;
	return 0;
}

uint32_t observations_pose_count(const struct observations *observations)
{
	uint32_t count = 0;

	for (uint32_t v = 0; v < observations->view_count; v++)
		count += v == 0 || observations->views[v].pose != observations->views[v - 1].pose;
	return count;
}

int observations_select(struct observations *part, const struct observations *whole,
			observations_keep_fn *keep, const void *user)
{
	struct observations made = *whole;
	uint32_t nth = 0;

	made.views = NULL;
	made.px = NULL;
	made.view_count = made.view_capacity = 0;
	for (uint32_t v = 0; v < whole->view_count; v++) {
		const struct observed_view *view = &whole->views[v];

		nth += v > 0 && view->pose != view[-1].pose;
		if (keep(view, nth, user) &&
		    observations_add(&made, view->camera, view->pose, observations_px(whole, v))) {
			observations_finish(&made);
			return -ENOMEM;
		}
	}
	*part = made;
	return 0;
}

struct digest {
	uint64_t low, high;
};

/* FNV-1a, 64 bits, from two starts. */
static void digest_add(struct digest *digest, const void *bytes, size_t count)
{
	const unsigned char *byte = bytes;

	for (size_t i = 0; i < count; i++) {
		digest->low = (digest->low ^ byte[i]) * UINT64_C(0x100000001b3);
		digest->high = (digest->high ^ byte[i] ^ 0x5a) * UINT64_C(0x100000001b3);
	}
}

/* Field by field: padding has no defined bytes. */
static void digest_board(struct digest *digest, const struct board *board)
{
	digest_add(digest, &board->squares_x, sizeof(board->squares_x));
	digest_add(digest, &board->squares_y, sizeof(board->squares_y));
	digest_add(digest, &board->square_m, sizeof(board->square_m));
	digest_add(digest, &board->tag_part, sizeof(board->tag_part));
	digest_add(digest, &board->first_id, sizeof(board->first_id));
}

static void digest_view(struct digest *digest, const struct observations *o, uint32_t view)
{
	digest_add(digest, &o->views[view].camera, sizeof(o->views[view].camera));
	digest_add(digest, &o->views[view].pose, sizeof(o->views[view].pose));
	for (uint32_t i = 0; i < o->corner_count; i++) {
		const double *px = observations_px(o, view)[i];

		if (!isnan(px[0]) && !isnan(px[1])) { /* NaN comes in many bytes */
			digest_add(digest, &i, sizeof(i));
			digest_add(digest, px, 2 * sizeof(*px));
		}
	}
}

void observations_hash(const struct observations *observations, char hash[OBSERVATIONS_HASH_BYTES])
{
	struct digest digest = {UINT64_C(0xcbf29ce484222325), UINT64_C(0x84222325cbf29ce4)};

	digest_board(&digest, &observations->board);
	for (uint32_t c = 0; c < observations->camera_count; c++) {
		const struct observed_camera *camera = &observations->cameras[c];

		digest_add(&digest, camera->name, strlen(camera->name) + 1);
		digest_add(&digest, &camera->width_px, sizeof(camera->width_px));
		digest_add(&digest, &camera->height_px, sizeof(camera->height_px));
	}
	for (uint32_t v = 0; v < observations->view_count; v++)
		digest_view(&digest, observations, v);
	snprintf(hash, OBSERVATIONS_HASH_BYTES, "%016" PRIx64 "%016" PRIx64, digest.high,
		 digest.low);
}
