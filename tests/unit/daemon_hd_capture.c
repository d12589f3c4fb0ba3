/*
 * HD frames and their shots: kept by the capture thread, placed by the solver.
 */
#include "daemon/hd_capture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"

#define WIDTH 64
#define HEIGHT 8
#define STRIDE 80
#define PERIOD_NS INT64_C(8333333)
#define BEGIN_NS INT64_C(5000000000) /* mid-exposure of shot 0 */
#define AFTER_IR_NS INT64_C(1875000)

static struct hd_capture hd;
static struct sync sync_at;
static uint8_t image[HEIGHT * STRIDE];

static int set_up(void **state)
{
	(void)state;
	sync_at = (struct sync){.period_ns = PERIOD_NS};
	return hd_capture_init(&hd, WIDTH * HEIGHT, 4 * PERIOD_NS);
}

static int tear_down(void **state)
{
	(void)state;
	hd_capture_finish(&hd);
	return 0;
}

static struct hd_plan plan_of(uint32_t phase)
{
	return (struct hd_plan){.camera_mask = 16,
				.divider = 4,
				.phase = phase,
				.phase_known = true,
				.after_ir_ns = AFTER_IR_NS};
}

static void shot_is_solved(uint64_t shot)
{
	sync_at.started = true;
	sync_at.last_shot = shot;
	sync_at.last_mid_exposure_ns = BEGIN_NS + (int64_t)shot * PERIOD_NS;
}

static struct frame frame_of(uint64_t shot, int64_t off_ns)
{
	return (struct frame){.pixels = image,
			      .width_px = WIDTH,
			      .height_px = HEIGHT,
			      .stride_bytes = STRIDE,
			      .format = PIXEL_BAYER_RG8,
			      .shot = SHOT_UNKNOWN,
			      .device_seq = shot / 4,
			      .mid_exposure_ns =
				      BEGIN_NS + (int64_t)shot * PERIOD_NS + AFTER_IR_NS + off_ns,
			      .row_time_ns = 14000};
}

static uint64_t shot_of_newest(void)
{
	const struct hd_frame *frame = hd_pool_hold(&hd.pool, hd_pool_newest(&hd.pool));

	assert_non_null(frame);
	uint64_t shot = atomic_load(&frame->shot);
	hd_pool_release(frame);
	return shot;
}

static void rows_are_copied_without_their_padding(void **state)
{
	struct frame frame = frame_of(0, 0);

	(void)state;
	for (int i = 0; i < HEIGHT * STRIDE; i++)
		image[i] = (uint8_t)(i % STRIDE < WIDTH ? i / STRIDE + 1 : 255);
	assert_true(hd_capture_keep(&hd, &frame));
	const struct hd_frame *kept = hd_pool_hold(&hd.pool, 1);
	assert_int_equal(kept->size_bytes, WIDTH * HEIGHT);
	for (int i = 0; i < WIDTH * HEIGHT; i++)
		assert_int_equal(kept->pixels[i], i / WIDTH + 1);
	assert_int_equal(kept->row_time_ns, 14000);
	assert_int_equal(kept->format, PIXEL_BAYER_RG8);
	hd_pool_release(kept);
}

static void a_compressed_picture_is_kept_to_its_last_byte(void **state)
{
	struct frame frame = frame_of(0, 0);

	(void)state;
	frame.format = PIXEL_MJPEG;
	frame.size_bytes = WIDTH + 1;
	for (int i = 0; i < WIDTH + 2; i++)
		image[i] = (uint8_t)(i + 1);
	assert_true(hd_capture_keep(&hd, &frame));
	const struct hd_frame *kept = hd_pool_hold(&hd.pool, 1);
	assert_int_equal(kept->size_bytes, WIDTH + 1);
	for (int i = 0; i <= WIDTH; i++)
		assert_int_equal(kept->pixels[i], i + 1);
	hd_pool_release(kept);
	frame.size_bytes = hd.pool.slot_bytes + 1;
	assert_false(hd_capture_keep(&hd, &frame));
}

static void a_frame_is_of_the_shot_nearest_by_the_plan(void **state)
{
	const int64_t offs_ns[] = {0, PERIOD_NS / 2 - 1000, -PERIOD_NS / 2 + 1000};
	const uint64_t solved[] = {90, 100, 101, 140}; /* before, with and after the frame */
	struct hd_plan plan = plan_of(0);

	(void)state;
	for (size_t s = 0; s < 4; s++)
		for (size_t i = 0; i < 3; i++) {
			struct frame frame = frame_of(100, offs_ns[i]);

			shot_is_solved(solved[s]);
			assert_true(hd_capture_keep(&hd, &frame));
			assert_int_equal(hd_capture_place(&hd, &plan, &sync_at, NULL, 0), 0);
			assert_int_equal(shot_of_newest(), 100);
		}
	assert_int_equal(atomic_load(&hd.last_shot), 100);
	assert_int_equal(atomic_load(&hd.off_phase), 0);
}

static void a_recording_knows_its_shots_itself(void **state)
{
	struct frame frame = frame_of(100, 0);
	struct hd_plan plan = plan_of(3);

	(void)state;
	frame.shot = 43;
	assert_true(hd_capture_keep(&hd, &frame));
	assert_int_equal(hd_capture_place(&hd, &plan, &sync_at, NULL, 0), 0);
	assert_int_equal(shot_of_newest(), 43);
}

static void a_frame_before_the_first_shot_stays_without(void **state)
{
	struct frame frame = frame_of(0, -20 * PERIOD_NS);
	struct hd_plan plan = plan_of(0);

	(void)state;
	assert_true(hd_capture_keep(&hd, &frame));
	assert_int_equal(hd_capture_place(&hd, &plan, &sync_at, NULL, 0), 1);
	assert_int_equal(shot_of_newest(), SHOT_UNKNOWN);
	shot_is_solved(2);
	assert_true(hd_capture_keep(&hd, &frame));
	assert_int_equal(hd_capture_place(&hd, &plan, &sync_at, NULL, 0), 1);
	assert_int_equal(shot_of_newest(), SHOT_UNKNOWN);
	assert_int_equal(atomic_load(&hd.last_shot), SHOT_UNKNOWN);
}

static void a_slipped_phase_is_counted(void **state)
{
	struct hd_plan plan = plan_of(1);

	(void)state;
	shot_is_solved(100);
	for (uint64_t shot = 101; shot < 113; shot += 4) {
		struct frame frame = frame_of(shot + (shot == 109), 0); /* the last one slips */

		assert_true(hd_capture_keep(&hd, &frame));
	}
	hd_capture_place(&hd, &plan, &sync_at, NULL, 0);
	assert_int_equal(atomic_load(&hd.off_phase), 1);
	assert_int_equal(atomic_load(&hd.last_shot), 110);
}

static void without_a_trigger_the_first_frame_tells_the_phase(void **state)
{
	struct hd_plan plan = {.camera_mask = 16, .divider = 4, .after_ir_ns = AFTER_IR_NS};
	struct frame frame = frame_of(102, 0);
	static struct marker_set set;

	(void)state;
	set.shot = 102;
	hd_plan_stamp(&plan, &set);
	assert_false(set.is_hd);
	shot_is_solved(101);
	assert_true(hd_capture_keep(&hd, &frame));
	hd_capture_place(&hd, &plan, &sync_at, NULL, 0);
	hd_plan_stamp(&plan, &set);
	assert_true(set.is_hd);
	assert_int_equal(set.hd_phase, 2);
	assert_int_equal(set.hd_index, 25);
	set.shot = 103;
	hd_plan_stamp(&plan, &set);
	assert_false(set.is_hd);
}

static void a_station_without_hd_cameras_has_no_hd_shots(void **state)
{
	struct hd_plan plan = plan_of(0);
	static struct marker_set set = {.shot = 8, .is_hd = 1};

	(void)state;
	plan.camera_mask = 0;
	hd_plan_stamp(&plan, &set);
	assert_false(set.is_hd);
}

static void frames_that_find_no_room_are_refused(void **state)
{
	const struct hd_frame *held[HD_POOL_SLOTS_MAX];
	uint32_t slots = hd.pool.slot_count;
	struct frame frame = frame_of(0, 0);

	(void)state;
	assert_true(slots * 4 * PERIOD_NS >= 250 * NS_PER_MS);
	for (uint32_t i = 0; i < slots; i++) {
		assert_true(hd_capture_keep(&hd, &frame));
		held[i] = hd_pool_hold(&hd.pool, i + 1);
		assert_non_null(held[i]);
	}
	assert_false(hd_capture_keep(&hd, &frame));
	for (uint32_t i = 0; i < slots; i++)
		hd_pool_release(held[i]);
	assert_true(hd_capture_keep(&hd, &frame));
}

static void frames_of_which_a_stalled_solver_is_not_told_are_refused(void **state)
{
	struct frame frame = frame_of(0, 0);

	(void)state;
	for (uint32_t i = 0; i < hd.notes.capacity; i++)
		assert_true(hd_capture_keep(&hd, &frame));
	assert_false(hd_capture_keep(&hd, &frame));
}

#define HD_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		HD_TEST(rows_are_copied_without_their_padding),
		HD_TEST(a_compressed_picture_is_kept_to_its_last_byte),
		HD_TEST(a_frame_is_of_the_shot_nearest_by_the_plan),
		HD_TEST(a_recording_knows_its_shots_itself),
		HD_TEST(a_frame_before_the_first_shot_stays_without),
		HD_TEST(a_slipped_phase_is_counted),
		HD_TEST(without_a_trigger_the_first_frame_tells_the_phase),
		HD_TEST(a_station_without_hd_cameras_has_no_hd_shots),
		HD_TEST(frames_that_find_no_room_are_refused),
		HD_TEST(frames_of_which_a_stalled_solver_is_not_told_are_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
