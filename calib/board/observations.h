/*
 * What cameras saw of a board that was waved: the one thing that a calibration is made from. The
 * same observations, in any order of adding, give the same rig.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"
#include "config/board.h"
#include "track/layout.h"

struct observed_camera {
	char name[NAME_BYTES];
	int width_px, height_px;
};

/* One camera's sight of the board in one pose. */
struct observed_view {
	uint32_t camera;
	uint32_t pose; /* whoever adds numbers them; cameras that exposed together share it */
	uint32_t seen_count;
};

struct observations {
	struct board board;
	uint32_t corner_count; /* of the board */
	uint32_t camera_count;
	struct observed_camera cameras[CAMERA_MAX];
	uint32_t view_count, view_capacity;
	struct observed_view *views; /* owned; by pose, then camera */
	double (*px)[2];             /* owned; corner_count per view; NaN: not seen */
};

/* Returns 0 or -EINVAL with messages. `board` is checked, names and sizes of cameras too. */
int observations_init(struct observations *observations, const struct board *board,
		      const struct observed_camera *cameras, uint32_t camera_count,
		      struct diag *diag);
void observations_finish(struct observations *observations); /* zeroed is fine */

/* Adds a view; `px` has corner_count places, NaN where a corner was not seen. Returns 0, -ENOMEM,
 * -EEXIST when the camera already has this pose, or -ERANGE when a corner lies outside its image:
 * then the picture was not of the camera's size. */
int observations_add(struct observations *observations, uint32_t camera, uint32_t pose,
		     const double (*px)[2]);

static inline const double (*observations_px(const struct observations *observations,
					     uint32_t view))[2]
{
	return (const double(*)[2])observations->px + (size_t)view * observations->corner_count;
}

/* Number of different poses. */
uint32_t observations_pose_count(const struct observations *observations);

/* A copy of the views for which `keep` says yes. Returns 0 or -ENOMEM. */
typedef bool observations_keep_fn(const struct observed_view *view, uint32_t nth_pose,
				  const void *user);
int observations_select(struct observations *part, const struct observations *whole,
			observations_keep_fn *keep, const void *user);

/* Two digests of board, cameras and corners, 128 bits in hexadecimal: names what a rig was made
 * from. */
#define OBSERVATIONS_HASH_BYTES 33
void observations_hash(const struct observations *observations, char hash[OBSERVATIONS_HASH_BYTES]);
