/*
 * How light a running camera's pictures are, and how many spots there are in them.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "ctl/camera/picture_plain.h"
#include "ctl/doctor/doctor_light.h"
#include "track/blobs/blobs.h"

#define FRAMES_SKIPPED 4 /* exposed before the light changed */
#define FRAMES_SKIPPED_HD 2
#define FRAMES 8
#define FRAMES_HD 4
#define FRAME_WAIT_NS (2 * NS_PER_S)

/* What one look needs. */
struct looking {
	const struct mask *mask;
	struct blob_settings settings;
	struct blob_finder *finder; /* made for the first picture; NULL for HD */
	struct blob_set *set;
	bool is_hd;
	double grey_sum, spots;
};

static size_t plain_bytes(const struct frame *frame, enum pixel_format format)
{
	return pixel_row_bytes(format, frame->width_px) * (size_t)frame->height_px;
}

static int count_spots(struct looking *looking, const struct frame *frame, const uint8_t *pixels)
{
	struct grey_image image = {pixels, frame->width_px, frame->height_px, frame->width_px, 8};
	int err = looking->finder ? 0
				  : blob_finder_create(&looking->finder, frame->width_px,
						       frame->height_px, &looking->settings);

	if (err)
		return err;
	blob_finder_run(looking->finder, &image, looking->set);
	mask_apply(looking->mask, looking->set);
	looking->spots += looking->set->blob_count;
	return 0;
}

static int look_at(struct looking *looking, const struct frame *frame)
{
	enum pixel_format format;
	uint8_t *pixels;
	int err = picture_make_plain(frame, &pixels, &format);
	uint64_t sum = 0;

	if (err)
		return err;
	size_t size = plain_bytes(frame, format);

	for (size_t i = 0; i < size; i++)
		sum += pixels[i];
	looking->grey_sum += size ? (double)sum / (double)size : 0;
	if (!looking->is_hd && format == PIXEL_GREY8)
		err = count_spots(looking, frame, pixels);
	free(pixels);
	return err;
}

/* The next picture that is whole. */
static int acquire(struct camera *camera, struct frame *frame)
{
	int64_t give_up_ns = clock_now_ns() + FRAME_WAIT_NS;
	int err;

	do
		err = camera->driver->acquire(camera, FRAME_WAIT_NS, frame);
	while (err == -EBADMSG && clock_now_ns() < give_up_ns);
	return err;
}

static int look(struct looking *looking, struct camera *camera, int skipped, int count)
{
	int err = 0;

	for (int i = 0; i < skipped + count && !err; i++) {
		struct frame frame;

		err = acquire(camera, &frame);
		if (err)
			break;
		if (i >= skipped)
			err = look_at(looking, &frame);
		camera->driver->release(camera, &frame);
	}
	return err;
}

int light_measure(struct light_level *out, const struct stage *stage, uint32_t c,
		  struct camera *camera, struct diag *diag)
{
	const struct config_camera *about = &stage->config.cameras[c];
	bool is_hd = about->role == ROLE_HD;
	int count = is_hd ? FRAMES_HD : FRAMES;
	struct looking looking = {.mask = &about->mask,
				  .settings = config_blobs(&stage->config, c),
				  .set = calloc(1, sizeof(*looking.set)),
				  .is_hd = is_hd};
	int err = looking.set ? look(&looking, camera, is_hd ? FRAMES_SKIPPED_HD : FRAMES_SKIPPED,
				     count)
			      : -ENOMEM;

	if (err)
		diag_add(diag, "%s: no picture: %s", about->address, strerror(-err));
	else
		*out = (struct light_level){looking.grey_sum / count, looking.spots / count};
	blob_finder_destroy(looking.finder);
	free(looking.set);
	return err;
}
