/*
 * The calibrating station: whose light, which pictures, and that it is the station of before when
 * it is over. On a simulated stage in virtual time.
 */
#include "virtual_station.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include <cmocka.h>

#include "calib/board/corners.h"
#include "sim/world/scene_parts.h"
#include "sim/world/world.h"

#define STAGE                                                                                \
	"trigger: sim\nsim: {scene: talking}\n"                                              \
	"calibration: {rate_hz: 5, exposure_us: 3000, board: {squares_x: 12, squares_y: 9, " \
	"square_m: 0.035}}\n"

static struct station *calibrate(uint32_t hd_count)
{
	struct station *station = virtual_station_start("talking", hd_count, STAGE);
	struct diag diag = {0};

	virtual_station_run_to(station, 0.2);
	assert_int_equal(station_start(station, STATION_CALIBRATE, &diag), EXIT_CODE_RUNNING);
	diag_finish(&diag);
	assert_true(station_stop(station));
	assert_null(station->pictures.memory);
	assert_int_equal(station_start(station, STATION_CALIBRATE, NULL), EXIT_CODE_OK);
	return station;
}

static int64_t exposed_ns(const struct picture_camera *camera)
{
	return camera->slots[camera->newest_seq % PICTURES_SLOTS].mid_exposure_ns;
}

static void all_cameras_are_exposed_together_at_the_rate_of_the_calibration(void **state)
{
	struct station *station = calibrate(1);
	const struct pictures *pictures = station->pictures.memory;

	(void)state;
	virtual_station_run_to(station, 2.05);
	assert_int_equal(pictures->camera_count, 5);
	assert_int_equal(pictures->period_ns, station->plan->period_ns);
	assert_true(llabs(pictures->period_ns - 200 * NS_PER_MS) < 5 * NS_PER_MS);
	for (int c = 0; c < 5; c++) {
		assert_int_equal(pictures->cameras[c].newest_seq, 10);
		assert_int_equal(exposed_ns(&pictures->cameras[c]),
				 exposed_ns(&pictures->cameras[0]));
	}
	assert_int_equal(station->captures[0].counters.missing, 0);
	assert_int_equal(station->captures[0].device.wanted.exposure_ns, 3 * NS_PER_MS);
	virtual_station_end(station);
}

static void the_station_runs_as_before_when_it_is_over(void **state)
{
	struct station *station = calibrate(1);

	(void)state;
	virtual_station_run_to(station, 0.5);
	assert_true(station_stop(station));
	assert_null(station->pictures.memory);
	assert_int_equal(station_start(station, STATION_START, NULL), EXIT_CODE_OK);
	assert_ptr_equal(station->plan, &station->stage.config.plan);
	assert_true(station->captures[0].device.wanted.exposure_ns != 3 * NS_PER_MS);
	double now_s = 1e-9 * (double)(clock_now_ns() - sim_world_epoch_ns());
	virtual_station_run_to(station, now_s + 0.5);
	assert_in_range(station->solver.shots, 50, 61);
	virtual_station_end(station);
}

/* The light is the same, the board that is waved another. */
static void it_calibrates_again_without_having_run(void **state)
{
	struct station *station = calibrate(1);

	(void)state;
	for (int again = 0; again < 2; again++) {
		virtual_station_run_to(station, 0.5 * (again + 1));
		assert_true(station->pictures.memory->cameras[4].newest_seq > 0);
		assert_true(station_stop(station));
		assert_int_equal(station_start(station, STATION_CALIBRATE, NULL), EXIT_CODE_OK);
	}
	virtual_station_run_to(station, 1.5);
	assert_true(station->pictures.memory->cameras[0].newest_seq > 0);
	virtual_station_end(station);
}

/* What a program that is handed the descriptor sees. */
static void pictures_show_the_board_and_can_only_be_read(void **state)
{
	struct station *station = calibrate(0);
	struct corner_settings settings = CORNER_SETTINGS_DEFAULT;
	struct corner_finder *finder;
	struct corners corners;
	size_t size_bytes = station->pictures.size_bytes;
	int fd = station->pictures.fd, found = 0;

	(void)state;
	virtual_station_run_to(station, 1.5);
	assert_ptr_equal(mmap(NULL, size_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0),
			 MAP_FAILED);
	struct pictures *pictures = mmap(NULL, size_bytes, PROT_READ, MAP_SHARED, fd, 0);
	assert_ptr_not_equal(pictures, MAP_FAILED);
	assert_int_equal(
		corner_finder_create(&finder, &station->stage.config.calibration.board, &settings),
		0);
	for (int c = 0; c < 4; c++) {
		const struct picture_camera *camera = &pictures->cameras[c];
		const struct picture_slot *slot =
			&camera->slots[camera->newest_seq % PICTURES_SLOTS];
		struct grey_image image = {(uint8_t *)pictures + slot->offset_bytes,
					   (int)camera->width_px, (int)camera->height_px,
					   (int)camera->width_px, 8};

		assert_int_equal(corner_finder_run(finder, &image, &corners), 0);
		found += corners.state == CORNERS_GOOD;
	}
	assert_in_range(found, 2, 4);
	corner_finder_destroy(finder);
	munmap(pictures, size_bytes);
	virtual_station_end(station);
}

static void without_a_rig_it_calibrates_and_does_not_run(void **state)
{
	struct station *station = virtual_station_configure("talking", 0, STAGE, "rig");
	struct diag diag = {0};

	(void)state;
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_BAD_INPUT);
	assert_non_null(strstr(diag.text, "there is no rig yet"));
	assert_int_equal(station_start(station, STATION_CALIBRATE, &diag), EXIT_CODE_OK);
	virtual_station_run_to(station, 0.5);
	assert_true(station->pictures.memory->cameras[3].newest_seq > 0);
	diag_finish(&diag);
	virtual_station_end(station);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(all_cameras_are_exposed_together_at_the_rate_of_the_calibration),
		cmocka_unit_test(the_station_runs_as_before_when_it_is_over),
		cmocka_unit_test(it_calibrates_again_without_having_run),
		cmocka_unit_test(pictures_show_the_board_and_can_only_be_read),
		cmocka_unit_test(without_a_rig_it_calibrates_and_does_not_run),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
