/*
 * libapriltag's detections as maps from the board to the picture.
 */
#include "calib/board/tags.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include "calib/board/homography.h"
#include "config/board_pattern.h"

#define MARGIN_MIN 15.0f /* of the decision over a tag's bits */
#define BITS_MENDED 1
#define APRILTAG_PIXEL 0.5

struct tag_finder {
	struct board board;
	apriltag_family_t *family;
	apriltag_detector_t *detector;
};

int tag_finder_create(struct tag_finder **out, const struct board *board)
{
	struct tag_finder *finder = calloc(1, sizeof(*finder));

	if (!finder)
		return -ENOMEM;
	finder->board = *board;
	finder->family = tag36h11_create();
	finder->detector = apriltag_detector_create();
	if (!finder->family || !finder->detector) {
		tag_finder_destroy(finder);
		return -ENOMEM;
	}
	apriltag_detector_add_family_bits(finder->detector, finder->family, BITS_MENDED);
	finder->detector->nthreads = 1;
	*out = finder;
	return 0;
}

void tag_finder_destroy(struct tag_finder *finder)
{
	if (!finder)
		return;
	if (finder->detector)
		apriltag_detector_destroy(finder->detector);
	if (finder->family)
		tag36h11_destroy(finder->family);
	free(finder);
}

/* libapriltag lists a tag's corners from the lower left one against the clock. */
static int map_tag(struct tag *tag, const struct board *board, int index,
		   const apriltag_detection_t *detection)
{
	static const double AT[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
	double from[4][2], to[4][2], corner_m[2], edge_m;

	board_tag_place(board, index, corner_m, &edge_m);
	for (int i = 0; i < 4; i++)
		for (int k = 0; k < 2; k++) {
			from[i][k] = corner_m[k] + AT[i][k] * edge_m;
			to[i][k] = detection->p[i][k] - APRILTAG_PIXEL;
		}
	return homography_fit(tag->h, (const double(*)[2])from, (const double(*)[2])to, 4);
}

static void take(struct tags *tags, const struct board *board,
		 const apriltag_detection_t *detection)
{
	int index = detection->id - board->first_id;

	if (detection->decision_margin < MARGIN_MIN)
		return;
	if (index < 0 || index >= board_tag_count(board)) {
		tags->foreign_count++;
		return;
	}
	struct tag *tag = &tags->tags[index];
	if (tag->found || map_tag(tag, board, index, detection))
		return;
	tag->found = true;
	tags->found_count++;
}

int tag_finder_run(struct tag_finder *finder, const struct grey_image *image, int decimate,
		   struct tags *tags)
{
	image_u8_t view = {.width = image->width_px,
			   .height = image->height_px,
			   .stride = image->stride_bytes,
			   .buf = (uint8_t *)(uintptr_t)image->pixels}; /* is only read */

	memset(tags, 0, sizeof(*tags));
	finder->detector->quad_decimate = (float)decimate;
	zarray_t *found = apriltag_detector_detect(finder->detector, &view);
	if (!found)
		return -ENOMEM;
	for (int i = 0; i < zarray_size(found); i++) {
		apriltag_detection_t *detection;

		zarray_get(found, i, &detection);
		take(tags, &finder->board, detection);
	}
	apriltag_detections_destroy(found);
	return 0;
}
