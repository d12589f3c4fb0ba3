/*
 * Our own pictures through the kernel: vivid_loopback CAPTURE-NODE OUTPUT-NODE. What is written to
 * the output comes back at the camera, and the same spots are found in it.
 */
#include <fcntl.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmocka.h>
#include <linux/videodev2.h>

#include "base/clock.h"
#include "sim/render/render.h"
#include "tests/hil/v4l2_stream.h"
#include "track/blobs/blobs.h"

#define WIDTH_PX 640
#define HEIGHT_PX 480
#define CROP_X_PX 320 /* of the simulated camera's picture: where the face is */
#define CROP_Y_PX 272
#define PICTURES 4
#define FRAMES_MAX 200
#define PATIENCE_S 10

static const char *capture_node, *output_node;
static uint8_t pictures[PICTURES][HEIGHT_PX][WIDTH_PX];
static struct blob_set truths[PICTURES];
static _Atomic bool ends;

static void render_pictures(void)
{
	struct sim_options options = {.scene = "talking", .camera_count = 4, .rate_hz = 10};
	struct sim_renderer *renderer;
	struct sim_scene *scene;

	assert_int_equal(sim_scene_create(&scene, &options, NULL), 0);
	assert_int_equal(sim_renderer_create(&renderer, scene, 0, SIM_NOISE_FULL), 0);
	for (int p = 0; p < PICTURES; p++) {
		int width_px, height_px;
		const uint8_t *image = sim_render(renderer, (uint64_t)p, &width_px, &height_px);

		assert_true(width_px >= CROP_X_PX + WIDTH_PX && height_px >= CROP_Y_PX + HEIGHT_PX);
		for (int y = 0; y < HEIGHT_PX; y++)
			memcpy(pictures[p][y], image + (long)(CROP_Y_PX + y) * width_px + CROP_X_PX,
			       WIDTH_PX);
	}
	sim_renderer_destroy(renderer);
	sim_scene_destroy(scene);
}

static void find_blobs(struct blob_finder *finder, const uint8_t *pixels, int stride_bytes,
		       struct blob_set *out)
{
	struct grey_image image = {pixels, WIDTH_PX, HEIGHT_PX, stride_bytes, 8};

	blob_finder_run(finder, &image, out);
}

/* The output's buffers, one per picture, are mapped, filled once and queued again and again. */
static void queue_picture(int fd, uint32_t index)
{
	struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT,
				     .memory = V4L2_MEMORY_MMAP,
				     .index = index,
				     .bytesused = sizeof(pictures[0])};

	if (ioctl(fd, VIDIOC_QBUF, &buffer))
		perror("output: queue");
}

static void start_output(int fd)
{
	struct v4l2_requestbuffers request = {
		.type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP, .count = PICTURES};
	int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;

	assert_int_equal(ioctl(fd, VIDIOC_REQBUFS, &request), 0);
	assert_int_equal(request.count, PICTURES);
	for (uint32_t p = 0; p < PICTURES; p++) {
		struct v4l2_buffer buffer = {
			.type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP, .index = p};

		assert_int_equal(ioctl(fd, VIDIOC_QUERYBUF, &buffer), 0);
		assert_true(buffer.length >= sizeof(pictures[p]));
		void *at = mmap(NULL, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd,
				buffer.m.offset);

		assert_true(at != MAP_FAILED);
		memcpy(at, pictures[p], sizeof(pictures[p]));
		munmap(at, buffer.length);
		queue_picture(fd, p);
	}
	assert_int_equal(ioctl(fd, VIDIOC_STREAMON, &type), 0);
}

static void *write_pictures(void *fd)
{
	while (!atomic_load(&ends)) {
		struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT,
					     .memory = V4L2_MEMORY_MMAP};

		if (ioctl(*(int *)fd, VIDIOC_DQBUF, &buffer))
			perror("output: dequeue");
		else
			queue_picture(*(int *)fd, buffer.index);
	}
	return NULL;
}

/* The picture whose spots these are, or -1. */
static int recognise(const struct blob_set *found)
{
	for (int p = 0; p < PICTURES; p++)
		if (found->blob_count == truths[p].blob_count &&
		    memcmp(found->blobs, truths[p].blobs,
			   found->blob_count * sizeof(found->blobs[0])) == 0)
			return p;
	return -1;
}

static void rendered_pictures_come_back_with_the_same_spots(void **state)
{
	static const struct camera_mode wanted = {
		.format = PIXEL_GREY8, .width_px = WIDTH_PX, .height_px = HEIGHT_PX};
	static struct blob_set found;
	struct v4l2_stream stream;
	struct blob_finder *finder;
	struct blob_settings settings = blob_settings_default();
	int fd = open(output_node, O_RDWR | O_CLOEXEC), seen_mask = 0, recognised = 0, strange = 0;
	pthread_t writer;

	(void)state;
	assert_true(fd >= 0);
	render_pictures();
	assert_int_equal(blob_finder_create(&finder, WIDTH_PX, HEIGHT_PX, &settings), 0);
	for (int p = 0; p < PICTURES; p++) {
		find_blobs(finder, pictures[p][0], WIDTH_PX, &truths[p]);
		assert_true(truths[p].blob_count > 20);
	}
	start_output(fd);
	assert_int_equal(pthread_create(&writer, NULL, write_pictures, &fd), 0);
	v4l2_stream_start(&stream, capture_node, &wanted);
	for (int i = 0; i < FRAMES_MAX && recognised < 20; i++) {
		struct frame frame;

		assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
		find_blobs(finder, frame.pixels, frame.stride_bytes, &found);
		int p = recognise(&found);

		v4l2_stream_release(&stream, &frame);
		if (p >= 0) {
			seen_mask |= 1 << p;
			recognised++;
		} else if (seen_mask) {
			strange++;
		}
	}
	v4l2_stream_stop(&stream);
	atomic_store(&ends, true);
	pthread_join(writer, NULL);
	close(fd);
	blob_finder_destroy(finder);
	printf("# %d frames recognised, pictures %x, %d strange\n", recognised, seen_mask, strange);
	assert_int_equal(recognised, 20);
	assert_int_equal(seen_mask, (1 << PICTURES) - 1);
	assert_int_equal(strange, 0);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rendered_pictures_come_back_with_the_same_spots),
	};

	if (argc != 3) {
		fprintf(stderr, "usage: %s CAPTURE-NODE OUTPUT-NODE\n", argv[0]);
		return EXIT_FAILURE;
	}
	capture_node = argv[1];
	output_node = argv[2];
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
