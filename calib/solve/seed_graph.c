/*
 * Cameras that saw the board together are linked; a tree of the strongest links places all of them.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/sort.h"
#include "calib/solve/seed_parts.h"
#include "track/rigid.h"

#define NEAR 3.0           /* times the median distance: still agrees */
#define DISTANCE_PART 2e-3 /* of the range: agrees anyway */
#define ENDS 4             /* outer corners of the board */

/* One pose that both cameras saw: the board's ends in the coordinates of each. */
struct meeting {
	struct vec3 from_m[ENDS], to_m[ENDS];
	struct pose rt_to_from;
	double distance_m; /* under the chosen pose */
};

/* One camera in the coordinates of another. */
struct link {
	uint32_t strength; /* meetings that agree; 0: none */
	struct pose rt_to_from;
};

static uint32_t find_meetings(const struct seed_work *work, uint32_t to, uint32_t from,
			      struct meeting *meetings)
{
	uint32_t count = 0;

	for (uint32_t n = 0; n < work->pose_count; n++) {
		uint32_t vt = seed_view(work, n, to), vf = seed_view(work, n, from);

		if (vt == NO_VIEW || vf == NO_VIEW)
			continue;
		struct meeting *meeting = &meetings[count++];
		struct pose rt_board_from = pose_inverse(&work->rt_cam_board[vf]);
		meeting->rt_to_from = pose_compose(&work->rt_cam_board[vt], &rt_board_from);
		for (int e = 0; e < ENDS; e++) {
			meeting->to_m[e] =
				pose_apply(&work->rt_cam_board[vt], work->board_ends_m[e]);
			meeting->from_m[e] =
				pose_apply(&work->rt_cam_board[vf], work->board_ends_m[e]);
		}
	}
	return count;
}

static double meeting_distance_m(const struct meeting *meeting, const struct pose *rt_to_from)
{
	double sum = 0;

	for (int e = 0; e < ENDS; e++)
		sum += vec3_distance(pose_apply(rt_to_from, meeting->from_m[e]), meeting->to_m[e]);
	return sum / ENDS;
}

/* The meeting whose pose most others agree with: least median distance. */
static double choose_pose(const struct meeting *meetings, uint32_t count, double *distances,
			  struct pose *rt_to_from)
{
	double best = INFINITY;

	for (uint32_t k = 0; k < count; k++) {
		for (uint32_t l = 0; l < count; l++)
			distances[l] = meeting_distance_m(&meetings[l], &meetings[k].rt_to_from);
		sort_doubles(distances, count);
		if (distances[count / 2] < best) {
			best = distances[count / 2];
			*rt_to_from = meetings[k].rt_to_from;
		}
	}
	return best;
}

static struct link fit_link(const struct meeting *meetings, uint32_t count,
			    const struct pose *chosen, double median_m, struct rigid_pair *pairs)
{
	struct link link = {0};
	int pair_count = 0;

	for (uint32_t k = 0; k < count; k++) {
		double limit_m = NEAR * median_m + DISTANCE_PART * vec3_norm(meetings[k].to_m[0]);

		if (meeting_distance_m(&meetings[k], chosen) > limit_m)
			continue;
		for (int e = 0; e < ENDS; e++)
			pairs[pair_count++] =
				(struct rigid_pair){meetings[k].from_m[e], meetings[k].to_m[e], 1};
		link.strength++;
	}
	if (link.strength < SEED_LINKS_MIN || rigid_fit(pairs, pair_count, &link.rt_to_from))
		link.strength = 0;
	return link;
}

struct graph_room {
	struct meeting *meetings;
	double *distances;
	struct rigid_pair *pairs;
};

static struct link find_link(const struct seed_work *work, uint32_t to, uint32_t from,
			     struct graph_room *room)
{
	uint32_t count = find_meetings(work, to, from, room->meetings);
	struct pose chosen = POSE_IDENTITY;

	if (count < SEED_LINKS_MIN)
		return (struct link){0};
	double median_m = choose_pose(room->meetings, count, room->distances, &chosen);
	return fit_link(room->meetings, count, &chosen, median_m, room->pairs);
}

static void find_links(const struct seed_work *work, struct link links[CAMERA_MAX][CAMERA_MAX],
		       struct graph_room *room)
{
	uint32_t count = work->observations->camera_count;

	for (uint32_t a = 0; a < count; a++)
		for (uint32_t b = a + 1; b < count; b++) {
			links[a][b] = find_link(work, a, b, room);
			links[b][a].strength = links[a][b].strength;
			if (links[a][b].strength)
				links[b][a].rt_to_from = pose_inverse(&links[a][b].rt_to_from);
		}
}

/* Prim's tree from camera 0, the strongest link first. Returns the cameras that it reaches. */
static uint32_t grow_tree(struct link links[CAMERA_MAX][CAMERA_MAX], uint32_t count,
			  struct pose *rt_cam_ref)
{
	uint32_t reached = 1;

	rt_cam_ref[0] = POSE_IDENTITY;
	for (uint32_t round = 1; round < count; round++) {
		uint32_t best = 0, to = 0, from = 0;

		for (uint32_t a = 0; a < count; a++)
			for (uint32_t b = 0; b < count; b++)
				if ((reached & 1U << a) && !(reached & 1U << b) &&
				    links[b][a].strength > best) {
					best = links[b][a].strength;
					to = b;
					from = a;
				}
		if (!best)
			break;
		rt_cam_ref[to] = pose_compose(&links[to][from].rt_to_from, &rt_cam_ref[from]);
		reached |= 1U << to;
	}
	return reached;
}

static void complain_of_missing_links(const struct seed_work *work, uint32_t reached)
{
	const struct observations *o = work->observations;

	for (uint32_t c = 0; c < o->camera_count; c++)
		if (!(reached & 1U << c))
			diag_add(work->diag,
				 "camera %s: no link to camera %s, not through other cameras "
				 "either; wave the board where it and a neighbour see it at the "
				 "same time, in %d places at least",
				 o->cameras[c].name, o->cameras[0].name, SEED_LINKS_MIN);
}

int seed_place_cameras(const struct seed_work *work, struct pose *rt_cam_ref)
{
	uint32_t count = work->observations->camera_count;
	struct graph_room room = {
		malloc(work->pose_count * sizeof(*room.meetings)),
		malloc(work->pose_count * sizeof(*room.distances)),
		malloc(work->pose_count * ENDS * sizeof(*room.pairs)),
	};
	struct link(*links)[CAMERA_MAX] = calloc(CAMERA_MAX, sizeof(*links));
	int err = -ENOMEM;

	if (room.meetings && room.distances && room.pairs && links) {
		find_links(work, links, &room);
		uint32_t reached = grow_tree(links, count, rt_cam_ref);
		err = reached == (uint32_t)((UINT64_C(1) << count) - 1) ? 0 : -EINVAL;
		if (err)
			complain_of_missing_links(work, reached);
	}
	free(room.meetings);
	free(room.distances);
	free(room.pairs);
	free(links);
	return err;
}
