/*
 * The aravis driver against simulated GigE Vision cameras: the real protocol over loopback. Truth
 * is the scene itself, rendered again here.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "sim/render/render.h"
#include "tests/contract/gige_camera.h"

#define SEED 5
#define RATE_HZ 100.0
#define WAIT_NS NS_PER_S
#define SHOTS 2000
#define GONE_WITHIN_NS (NS_PER_S * 5 / 2) /* 1.7 s on an idle machine */
#define STOP_WITHIN_NS NS_PER_S

static const struct camera_driver *const driver = &aravis_camera_driver;

struct fixture {
	struct gige_child child, lossy;
	int64_t epoch_ns;
	struct sim_scene *scene;
};

static int start_child(struct gige_child *child, uint32_t block, int64_t epoch_ns,
		       const char *lost_ratio)
{
	char epoch[32];
	const char *extra[] = {"--seed",         "5",        "--rate", "100", "--epoch-ns", epoch,
			       "--lost-packets", lost_ratio, NULL};

	snprintf(epoch, sizeof(epoch), "%" PRId64, epoch_ns);
	return gige_child_start(child, gige_program, block, extra, gige_log_path);
}

static int set_up(void **state)
{
	static struct fixture f;
	struct sim_options options = {.seed = SEED, .camera_count = 4, .rate_hz = RATE_HZ};

	f.epoch_ns = clock_now_ns();
	*state = &f;
	if (sim_scene_create(&f.scene, &options, NULL))
		return -1;
	if (start_child(&f.child, 0, f.epoch_ns, "0"))
		return -1;
	return start_child(&f.lossy, 1, f.epoch_ns, "0.002");
}

static int tear_down(void **state)
{
	struct fixture *f = *state;

	gige_child_end(&f->child, SIGKILL);
	gige_child_end(&f->lossy, SIGKILL);
	sim_scene_destroy(f->scene);
	unlink(gige_log_path);
	return 0;
}

static uint64_t shot_of(const struct fixture *f, const struct frame *frame)
{
	int64_t period_ns = sim_scene_period_ns(f->scene);
	int64_t since_ns =
		frame->mid_exposure_ns - f->epoch_ns - sim_scene_mid_exposure_ns(f->scene, 0);

	return (uint64_t)((since_ns + period_ns / 2) / period_ns);
}

/* The picture and the times of a frame of camera `index` are those of the scene. */
static void check_frame(const struct fixture *f, struct sim_renderer *truth,
			const struct frame *frame)
{
	uint64_t shot = shot_of(f, frame);
	int64_t true_mid_ns = f->epoch_ns + sim_scene_mid_exposure_ns(f->scene, shot);
	int width_px, height_px;
	const uint8_t *image = sim_render(truth, shot, &width_px, &height_px);

	assert_int_equal(frame->width_px, width_px);
	assert_int_equal(frame->height_px, height_px);
	assert_int_equal(frame->stride_bytes, width_px);
	assert_int_equal(frame->format, PIXEL_GREY8);
	assert_memory_equal(frame->pixels, image, (size_t)width_px * height_px);
	assert_true(llabs(frame->mid_exposure_ns - true_mid_ns) <= frame->uncertainty_ns);
	assert_true(frame->arrival_ns > true_mid_ns);
	assert_true(frame->arrival_ns <= clock_now_ns());
}

/* Aravis starts counting at 65400, so that 200 frames pass the end of the 16-bit frame ids. */
static void frames_are_bit_exact_in_sequence_and_on_time(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->child, 1);
	struct camera_mode mode = gige_camera_start(camera, true);
	struct sim_renderer *truth;
	uint64_t offset = 0;

	assert_int_equal(mode.period_ns, sim_scene_period_ns(f->scene));
	assert_true(mode.triggered);
	assert_int_equal(sim_renderer_create(&truth, f->scene, 1, SIM_NOISE_FAST), 0);
	for (int i = 0; i < 200; i++) {
		struct frame frame;

		assert_int_equal(gige_camera_acquire(camera, &f->child, WAIT_NS, &frame), 0);
		check_frame(f, truth, &frame);
		/* When the busy machine made the simulator skip a shot, its counter does not. */
		if (i == 0)
			offset = frame.device_seq - shot_of(f, &frame);
		assert_true(frame.device_seq - shot_of(f, &frame) <= offset);
		driver->release(camera, &frame);
		if (i == 199)
			assert_true(frame.device_seq > 65535);
	}
	sim_renderer_destroy(truth);
	gige_camera_stop(camera);
}

/* Reads one frame of every camera and marks its shot, from `base` on, with the camera's bit.
 * Returns how many shots became complete. */
static int mark_shots(const struct fixture *f, struct camera *const cameras[4], uint64_t base,
		      uint8_t seen[SHOTS])
{
	int complete = 0;

	for (uint32_t i = 0; i < 4; i++) {
		struct frame frame;

		if (driver->acquire(cameras[i], WAIT_NS, &frame))
			continue;
		uint64_t shot = shot_of(f, &frame);
		int64_t true_mid_ns = f->epoch_ns + sim_scene_mid_exposure_ns(f->scene, shot);

		assert_true(llabs(frame.mid_exposure_ns - true_mid_ns) <= frame.uncertainty_ns);
		if (shot - base < SHOTS) {
			seen[shot - base] |= (uint8_t)(1u << i);
			complete += seen[shot - base] == 0xf;
		}
		driver->release(cameras[i], &frame);
	}
	return complete;
}

/* A reader that stood still has lost other shots of each camera: then it takes longer. */
static void all_cameras_show_the_same_shots(void **state)
{
	struct fixture *f = *state;
	struct camera *cameras[4];
	uint8_t seen[SHOTS] = {0};
	int complete = 0;

	for (uint32_t i = 0; i < 4; i++) {
		cameras[i] = gige_camera_open(&f->child, i);
		gige_camera_start(cameras[i], i % 2 == 0); /* wired to the pulse either way */
	}
	uint64_t base = (uint64_t)((clock_now_ns() - f->epoch_ns) / sim_scene_period_ns(f->scene));

	for (int i = 0; i < SHOTS && complete < 40; i++)
		complete += mark_shots(f, cameras, base, seen);
	for (uint32_t i = 0; i < 4; i++)
		gige_camera_stop(cameras[i]);
	assert_int_equal(complete, 40);
}

static void camera_starts_again_after_a_stop(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->child, 0);
	struct frame frame;

	for (int i = 0; i < 3; i++) {
		gige_camera_start(camera, true);
		assert_int_equal(gige_camera_acquire(camera, &f->child, WAIT_NS, &frame), 0);
		driver->release(camera, &frame);
		driver->stop(camera);
	}
	driver->close(camera);
}

/* The pool is a quarter of a second: what a longer stall loses shows as a gap, and it goes on. The
 * frame under way when buffers are free again may be damaged. */
static void stalled_reader_recovers_and_its_loss_shows(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->child, 2);
	struct sim_renderer *truth;
	uint64_t first_seq = 0;
	int whole = 0, damaged = 0;
	struct frame frame;

	gige_camera_start(camera, true);
	assert_int_equal(sim_renderer_create(&truth, f->scene, 2, SIM_NOISE_FAST), 0);
	clock_sleep_until(clock_now_ns() + NS_PER_S);
	while (whole < 60) {
		int error = gige_camera_acquire(camera, &f->child, WAIT_NS, &frame);

		damaged += error == -EBADMSG;
		assert_true(!error || (error == -EBADMSG && damaged == 1));
		if (error)
			continue;
		check_frame(f, truth, &frame);
		if (whole++ == 0)
			first_seq = frame.device_seq;
		driver->release(camera, &frame);
	}
	assert_true(frame.device_seq - first_seq > 80);
	sim_renderer_destroy(truth);
	gige_camera_stop(camera);
}

/* What a released frame's place holds changes while nobody acquires: the receiver writes there, so
 * nobody has copied. */
static void frames_are_lent_where_the_receiver_put_them(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->child, 3);
	struct camera_mode mode = gige_camera_start(camera, true);
	size_t size_bytes = (size_t)mode.width_px * (size_t)mode.height_px;
	uint8_t *before = malloc(size_bytes);
	struct frame frame, other;

	assert_non_null(before);
	assert_int_equal(gige_camera_acquire(camera, &f->child, WAIT_NS, &frame), 0);
	assert_int_equal(gige_camera_acquire(camera, &f->child, WAIT_NS, &other), 0);
	assert_ptr_not_equal(frame.pixels, other.pixels);
	const uint8_t *place = frame.pixels;

	memcpy(before, place, size_bytes);
	driver->release(camera, &frame);
	clock_sleep_until(clock_now_ns() + NS_PER_S);
	assert_memory_not_equal(before, place, size_bytes);
	free(before);
	driver->release(camera, &other);
	gige_camera_stop(camera);
}

/* Opens, expects `error`, and finds each of the words in the one message. */
static void refused(const char *rest, int error, const char *word, const char *other)
{
	struct camera *untouched = (struct camera *)&refused, *camera = untouched;
	struct diag diag = {0};

	assert_int_equal(driver->open(&camera, rest, NULL, &diag), error);
	assert_ptr_equal(camera, untouched);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, rest));
	assert_non_null(strstr(diag.text, word));
	assert_non_null(strstr(diag.text, other));
	diag_finish(&diag);
}

static void address_without_a_camera_is_named(void **state)
{
	struct fixture *f = *state;
	char address[16];

	gige_child_address(&f->child, 6, address);
	refused(address, -ENODEV, "no camera here", "camera list");
	refused("no-such-serial", -ENODEV, "no such camera", "camera list");
}

static void format_that_it_has_not_is_refused(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->child, 0);
	struct camera_mode wanted = {.format = PIXEL_RGB8}, granted = {.width_px = -1};
	struct diag diag = {0};

	assert_int_equal(driver->configure(camera, &wanted, &granted, &diag), -ENOTSUP);
	assert_int_equal(granted.width_px, -1);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, "rgb is wanted, the camera offers Mono8"));
	assert_non_null(strstr(diag.text, "grey comes from Mono8"));
	diag_finish(&diag);
	driver->close(camera);
}

static void count_ours(const struct camera_info *info, void *user)
{
	void **ours = user;
	const struct gige_child *child = ours[0];
	char address[16], whole[32];

	for (uint32_t i = 0; i < 4; i++) {
		gige_child_address(child, i, address);
		snprintf(whole, sizeof(whole), "aravis:%s", address);
		if (strcmp(info->address, whole) == 0 && strcmp(info->model, "stage sim-gige") == 0)
			++*(int *)ours[1];
	}
}

static void discovery_finds_every_camera(void **state)
{
	struct fixture *f = *state;
	int found = 0;
	void *ours[] = {&f->child, &found};

	assert_int_equal(driver->list(count_ours, ours, NULL), 0);
	assert_int_equal(found, 4);
}

static void second_simulator_on_an_address_is_refused(void **state)
{
	struct fixture *f = *state;
	struct gige_child second;
	char message[256] = "";

	assert_int_equal(start_child(&second, 0, f->epoch_ns, "0"), -1);
	int status = gige_child_end(&second, 0);
	FILE *log = fopen(gige_log_path, "re");

	assert_true(WIFEXITED(status) && WEXITSTATUS(status) == EXIT_FAILURE);
	assert_non_null(log);
	assert_non_null(fgets(message, sizeof(message), log));
	fclose(log);
	assert_non_null(strstr(message, f->child.first_address));
	assert_non_null(strstr(message, "in use"));
}

static void damaged_frames_are_refused_and_whole_ones_are_right(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->lossy, 0);
	struct sim_renderer *truth;
	int damaged = 0, whole = 0;

	gige_camera_start(camera, true);
	assert_int_equal(sim_renderer_create(&truth, f->scene, 0, SIM_NOISE_FAST), 0);
	while (damaged + whole < 100) {
		struct frame frame;
		int error = driver->acquire(camera, WAIT_NS, &frame);

		damaged += error == -EBADMSG;
		assert_true(error == 0 || error == -EBADMSG);
		if (error)
			continue;
		whole++;
		check_frame(f, truth, &frame);
		driver->release(camera, &frame);
	}
	assert_true(gige_camera_count(camera, "failures") >= damaged);
	assert_in_range(damaged, 3, 50); /* 84 packets a frame: 15 are expected */
	sim_renderer_destroy(truth);
	gige_camera_stop(camera);
}

static void second_receiver_is_told_that_the_camera_is_busy(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->lossy, 3);
	char address[16];

	gige_child_address(&f->lossy, 3, address);
	refused(address, -EBUSY, "busy: another program controls this camera", "end it");
	driver->close(camera);
}

/* Until the driver says that it is gone for good; frames that came before are whole. */
static int64_t gone_after_ns(struct camera *camera, int64_t since_ns)
{
	struct frame frame;
	int error;

	do {
		error = driver->acquire(camera, WAIT_NS / 10, &frame);
		if (!error)
			driver->release(camera, &frame);
	} while (error != -ENODEV && clock_now_ns() < since_ns + 2 * GONE_WITHIN_NS);
	assert_int_equal(error, -ENODEV);
	assert_int_equal(driver->acquire(camera, 0, &frame), -ENODEV);
	return clock_now_ns() - since_ns;
}

static void unplugged_camera_is_soon_gone_and_keeps_nobody_waiting(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->child, 0);
	struct sim_renderer *truth;
	struct frame frame;

	gige_camera_start(camera, true);
	assert_int_equal(sim_renderer_create(&truth, f->scene, 0, SIM_NOISE_FAST), 0);
	clock_sleep_until(clock_now_ns() + NS_PER_S / 5);
	gige_child_end(&f->child, SIGKILL);
	int64_t unplugged_ns = clock_now_ns();

	assert_int_equal(gige_camera_acquire(camera, &f->child, WAIT_NS, &frame), 0);
	check_frame(f, truth, &frame);
	driver->release(camera, &frame);
	assert_in_range(gone_after_ns(camera, unplugged_ns), 0, GONE_WITHIN_NS);
	int64_t gone_ns = clock_now_ns();

	gige_camera_stop(camera);
	assert_in_range(clock_now_ns() - gone_ns, 0, STOP_WITHIN_NS);
	sim_renderer_destroy(truth);
}

/* A cable that is pulled answers nothing at all. */
static void camera_that_vanishes_before_the_start_is_gone(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->lossy, 2);
	struct camera_mode mode = {.format = PIXEL_GREY8};
	struct diag diag = {0};

	assert_int_equal(driver->configure(camera, &mode, &mode, &diag), 0);
	kill(f->lossy.pid, SIGSTOP);
	int error = driver->start(camera, &diag);

	kill(f->lossy.pid, SIGCONT);
	assert_int_equal(error, -ENODEV);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, "it does not answer: check power and cable"));
	diag_finish(&diag);
	driver->close(camera);
}

static void silent_camera_is_soon_gone(void **state)
{
	struct fixture *f = *state;
	struct camera *camera = gige_camera_open(&f->lossy, 1);

	gige_camera_start(camera, true);
	kill(f->lossy.pid, SIGSTOP);
	int64_t after_ns = gone_after_ns(camera, clock_now_ns());

	kill(f->lossy.pid, SIGCONT);
	gige_camera_stop(camera);
	assert_in_range(after_ns, 0, GONE_WITHIN_NS);
}

static void told_to_end_the_simulator_ends(void **state)
{
	struct fixture *f = *state;

	assert_int_equal(gige_child_end(&f->lossy, SIGTERM), 0);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(frames_are_bit_exact_in_sequence_and_on_time),
		cmocka_unit_test(all_cameras_show_the_same_shots),
		cmocka_unit_test(camera_starts_again_after_a_stop),
		cmocka_unit_test(stalled_reader_recovers_and_its_loss_shows),
		cmocka_unit_test(address_without_a_camera_is_named),
		cmocka_unit_test(format_that_it_has_not_is_refused),
		cmocka_unit_test(discovery_finds_every_camera),
		cmocka_unit_test(second_simulator_on_an_address_is_refused),
		cmocka_unit_test(damaged_frames_are_refused_and_whole_ones_are_right),
		cmocka_unit_test(frames_are_lent_where_the_receiver_put_them),
		cmocka_unit_test(second_receiver_is_told_that_the_camera_is_busy),
		cmocka_unit_test(unplugged_camera_is_soon_gone_and_keeps_nobody_waiting),
		cmocka_unit_test(camera_that_vanishes_before_the_start_is_gone),
		cmocka_unit_test(silent_camera_is_soon_gone),
		cmocka_unit_test(told_to_end_the_simulator_ends),
	};

	if (gige_take_program(argc, argv))
		return EXIT_FAILURE;
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
