/*
 * The aravis driver on a network that loses packets: with cameras that send them again, and with
 * cameras that do not.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/clock.h"
#include "sim/render/render.h"
#include "tests/contract/gige_camera.h"

#define WAIT_NS NS_PER_S
#define FRAMES 100
#define PACKETS 84  /* a frame */
#define LOST "0.01" /* of them: hardly a frame is whole */

static const struct camera_driver *const driver = &aravis_camera_driver;
static struct gige_child resending, forgetful;

static int set_up(void **state)
{
	const char *with[] = {"--rate", "50", "--lost-packets", LOST, "--resend", NULL};
	const char *without[] = {"--rate", "50", "--lost-packets", LOST, NULL};

	(void)state;
	if (gige_child_start(&resending, gige_program, 0, with, gige_log_path))
		return -1;
	return gige_child_start(&forgetful, gige_program, 1, without, gige_log_path);
}

static int tear_down(void **state)
{
	(void)state;
	gige_child_end(&resending, SIGTERM);
	gige_child_end(&forgetful, SIGTERM);
	return unlink(gige_log_path);
}

struct outcome {
	int whole, damaged, gaps;
};

static struct outcome take_frames(struct camera *camera)
{
	struct outcome seen = {0};
	uint64_t last = 0;

	while (seen.whole + seen.damaged < FRAMES) {
		struct frame frame;
		int error = driver->acquire(camera, WAIT_NS, &frame);

		assert_true(error == 0 || error == -EBADMSG);
		seen.damaged += error != 0;
		if (error)
			continue;
		seen.gaps += seen.whole > 0 && frame.device_seq != last + 1;
		last = frame.device_seq;
		seen.whole++;
		driver->release(camera, &frame);
	}
	return seen;
}

static void lost_packets_are_sent_again_and_frames_are_whole(void **state)
{
	struct camera *camera = gige_camera_open(&resending, 0);

	(void)state;
	gige_camera_start(camera, true);
	struct outcome seen = take_frames(camera);

	assert_in_range(seen.whole, FRAMES * 9 / 10, FRAMES); /* a busy machine may be late */
	/* 84 of 8400 packets are lost; some of those that are sent again once more */
	assert_in_range(gige_camera_count(camera, "resent_packets"), 40, 200);
	assert_true(gige_camera_count(camera, "resend_requests") >= 40);
	/* of a frame that was given up for being late, all may be missing */
	assert_true(gige_camera_count(camera, "missing_packets") <=
		    gige_camera_count(camera, "resent_packets") +
			    PACKETS * gige_camera_count(camera, "failures"));
	gige_camera_stop(camera);
}

static void without_resending_each_damaged_frame_is_told_and_its_packets_are_counted(void **state)
{
	struct camera *camera = gige_camera_open(&forgetful, 0);

	(void)state;
	gige_camera_start(camera, true);
	struct outcome seen = take_frames(camera);

	assert_in_range(seen.whole, FRAMES / 5, FRAMES * 7 / 10); /* 43 % are whole */
	assert_in_range(seen.damaged, FRAMES * 3 / 10, FRAMES * 4 / 5);
	assert_true(seen.gaps > 0); /* the device counted them */
	assert_true(gige_camera_count(camera, "failures") >= seen.damaged);
	assert_true(gige_camera_count(camera, "missing_packets") >= seen.damaged);
	assert_int_equal(gige_camera_count(camera, "resend_requests"), 0);
	assert_int_equal(gige_camera_count(camera, "resent_packets"), 0);
	gige_camera_stop(camera);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lost_packets_are_sent_again_and_frames_are_whole),
		cmocka_unit_test(
			without_resending_each_damaged_frame_is_told_and_its_packets_are_counted),
	};

	if (gige_take_program(argc, argv))
		return EXIT_FAILURE;
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
