/*
 * The station with cameras that misbehave on command: what they lose is counted, and nobody else
 * waits for them. The fake driver takes the place of the program's list of drivers.
 */
#include "daemon/station.h"

#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock_virtual.h"
#include "daemon/program_drivers.h"
#include "drivers/trigger_free.h"
#include "sim/scene.h"

#define CAMERA_COUNT 4
#define WIDTH_PX 1280
#define HEIGHT_PX 1024
#define PERIOD_NS (10 * NS_PER_MS)

/* What a fake camera does from now on. */
enum fault {
	FAULT_NONE,
	FAULT_SILENT,  /* nothing comes */
	FAULT_GONE,    /* -ENODEV, and not there to open */
	FAULT_DAMAGED, /* -EBADMSG for every frame */
	FAULT_FOREIGN_CLOCK,
	FAULT_GAPS,   /* the device loses every second frame */
	FAULT_REPEAT, /* every frame comes twice */
	FAULT_OTHER_SIZE,
	FAULT_OVER, /* the recording is over */
};

struct fake_camera {
	struct camera base;
	_Atomic int *fault;
	int64_t next_ns;
	uint64_t seq;
	bool repeat;
};

static _Atomic int faults[CAMERA_COUNT];
static _Atomic int open_count;
static int64_t granted_period_ns; /* 0: the device does not tell */
static uint8_t black[WIDTH_PX * HEIGHT_PX];
static char stage_dir[] = "/tmp/stage-test-XXXXXX";
static char config_path[PATH_MAX];

static int fake_list(camera_found_fn *found, void *user, struct diag *diag)
{
	(void)found, (void)user, (void)diag;
	return 0;
}

static int fake_open(struct camera **out, const char *rest, const char *base_dir, struct diag *diag)
{
	_Atomic int *fault = &faults[rest[0] - '0'];
	struct fake_camera *camera;

	(void)base_dir;
	if (atomic_load(fault) == FAULT_GONE) {
		diag_add(diag, "fake:%s: not there: plug it in", rest);
		return -ENODEV;
	}
	camera = calloc(1, sizeof(*camera));
	camera->fault = fault;
	*out = &camera->base;
	open_count++;
	return 0;
}

static void fake_close(struct camera *camera)
{
	if (camera)
		open_count--;
	free(camera);
}

static int fake_configure(struct camera *camera, const struct camera_mode *wanted,
			  struct camera_mode *granted, struct diag *diag)
{
	(void)camera, (void)wanted, (void)diag;
	*granted = (struct camera_mode){
		.width_px = WIDTH_PX, .height_px = HEIGHT_PX, .period_ns = granted_period_ns};
	return 0;
}

static int fake_start(struct camera *base, struct diag *diag)
{
	struct fake_camera *camera = (struct fake_camera *)base;

	if (atomic_load(camera->fault) == FAULT_GONE) {
		diag_add(diag, "fake: does not start: plug it in");
		return -ENODEV;
	}
	/* all cameras expose at whole periods */
	camera->next_ns = (clock_now_ns() / PERIOD_NS + 1) * PERIOD_NS;
	return 0;
}

static void fake_stop(struct camera *camera)
{
	(void)camera;
}

static void fill_frame(struct fake_camera *camera, int fault, struct frame *out)
{
	*out = (struct frame){.pixels = black,
			      .width_px = fault == FAULT_OTHER_SIZE ? WIDTH_PX / 2 : WIDTH_PX,
			      .height_px = HEIGHT_PX,
			      .stride_bytes = WIDTH_PX,
			      .shot = SHOT_UNKNOWN,
			      .device_seq = camera->seq,
			      .mid_exposure_ns = camera->next_ns,
			      .arrival_ns = clock_now_ns()};
	if (fault == FAULT_FOREIGN_CLOCK)
		out->mid_exposure_ns = 42;
}

static int fake_acquire(struct camera *base, int64_t timeout_ns, struct frame *out)
{
	struct fake_camera *camera = (struct fake_camera *)base;
	int fault = atomic_load(camera->fault);

	if (fault == FAULT_GONE || fault == FAULT_OVER)
		return fault == FAULT_GONE ? -ENODEV : -ENODATA;
	if (camera->repeat) {
		camera->repeat = false;
		fill_frame(camera, fault, out);
		return 0;
	}
	if (fault == FAULT_SILENT) {
		clock_sleep_until(clock_now_ns() + timeout_ns / 10);
		camera->next_ns = (clock_now_ns() / PERIOD_NS + 1) * PERIOD_NS;
		return -ETIMEDOUT;
	}
	do {
		camera->next_ns += PERIOD_NS;
		camera->seq++;
	} while (fault == FAULT_GAPS && camera->seq % 2);
	/* each camera is a little later than the one before it */
	clock_sleep_until(camera->next_ns + (camera->fault - faults) * NS_PER_MS / 2);
	camera->repeat = fault == FAULT_REPEAT;
	fill_frame(camera, fault, out);
	return fault == FAULT_DAMAGED ? -EBADMSG : 0;
}

static void fake_release(struct camera *camera, struct frame *frame)
{
	(void)camera, (void)frame;
}

static const struct camera_driver fake_driver = {
	.name = "fake",
	.list = fake_list,
	.open = fake_open,
	.close = fake_close,
	.configure = fake_configure,
	.start = fake_start,
	.stop = fake_stop,
	.acquire = fake_acquire,
	.release = fake_release,
};

const struct camera_driver *const camera_drivers[] = {&fake_driver, NULL};
const struct trigger_driver *const trigger_drivers[] = {&free_trigger_driver, NULL};

static void take_sets(struct station *station)
{
	struct pollfd poll_fd = {.fd = station->wake_fd, .events = POLLIN};
	eventfd_t ignored;

	poll(&poll_fd, 1, 1);
	eventfd_read(station->wake_fd, &ignored);
	while (station_next_set(station))
		station_pop_set(station);
}

/* Runs for a while of virtual time, as the control thread does: takes the sets, ticks now and then.
 */
static void run_for(struct station *station, int64_t duration_ns)
{
	int64_t end_ns = clock_virtual_limit() + duration_ns;

	while (clock_virtual_limit() < end_ns) {
		clock_virtual_set_limit(clock_virtual_limit() + 20 * NS_PER_MS);
		while (!clock_virtual_at_limit())
			take_sets(station);
		station_tick(station);
	}
}

static struct station *start_station(void)
{
	struct station *station = calloc(1, sizeof(*station));
	struct diag diag = {0};

	clock_virtual_begin(1000 * NS_PER_S, 1000 * NS_PER_S);
	for (int c = 0; c < CAMERA_COUNT; c++)
		faults[c] = FAULT_NONE;
	assert_int_equal(station_load(station, config_path, &diag), EXIT_CODE_OK);
	assert_int_equal(station_configure(station, &diag), EXIT_CODE_OK);
	assert_int_equal(station->state, STATION_CONFIGURED);
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
	assert_int_equal(station->state, STATION_RUNNING);
	run_for(station, 60 * NS_PER_MS);
	return station;
}

static void end_station(struct station *station)
{
	station_finish(station);
	assert_int_equal(station->state, STATION_IDLE);
	assert_int_equal(open_count, 0);
	free(station);
	clock_virtual_end();
}

/* Shots solved in `duration_ns` while camera 1 has a fault. */
static uint64_t shots_with_fault(struct station *station, enum fault fault, int64_t duration_ns)
{
	uint64_t before = station->solver.shots;

	faults[1] = fault;
	run_for(station, duration_ns);
	return station->solver.shots - before;
}

static void a_silent_camera_stalls_nobody(void **state)
{
	struct station *station = start_station();
	uint64_t shots = shots_with_fault(station, FAULT_SILENT, 600 * NS_PER_MS);

	(void)state;
	assert_in_range(shots, 45, 66);
	assert_in_range(station->captures[1].counters.missing, 40, 70);
	assert_in_range(station->captures[0].counters.missing, 0, 3);
	end_station(station);
}

static void a_camera_that_speaks_again_is_waited_for_again(void **state)
{
	struct station *station = start_station();

	(void)state;
	shots_with_fault(station, FAULT_SILENT, 300 * NS_PER_MS);
	shots_with_fault(station, FAULT_NONE, 100 * NS_PER_MS);
	uint64_t missing = station->captures[1].counters.missing;
	uint64_t shots = shots_with_fault(station, FAULT_NONE, 200 * NS_PER_MS);
	assert_in_range(shots, 10, 30);
	assert_in_range(station->captures[1].counters.missing - missing, 0, 1);
	end_station(station);
}

static void shots_begin_when_all_cameras_run(void **state)
{
	struct station *station = start_station();

	(void)state;
	assert_in_range(station->solver.shots, 1, 20);
	assert_int_equal(station->solver.incomplete, 0);
	end_station(station);
}

static void a_vanished_camera_comes_back_by_itself(void **state)
{
	struct station *station = start_station();
	uint64_t shots = shots_with_fault(station, FAULT_GONE, 200 * NS_PER_MS);

	(void)state;
	assert_in_range(shots, 10, 30);
	assert_int_equal(station->captures[1].state, CAPTURE_LOST);
	shots_with_fault(station, FAULT_NONE, 200 * NS_PER_MS);
	assert_int_equal(station->captures[1].state, CAPTURE_RUNNING);
	assert_int_equal(station->captures[1].counters.reopened, 1);
	uint64_t missing = station->captures[1].counters.missing;
	run_for(station, 200 * NS_PER_MS);
	assert_in_range(station->captures[1].counters.missing - missing, 0, 3);
	end_station(station);
}

static void every_lost_camera_says_since_when_and_why(void **state)
{
	struct station *station = start_station();
	int64_t before_ns = clock_now_ns();

	(void)state;
	faults[2] = FAULT_GONE;
	shots_with_fault(station, FAULT_GONE, 200 * NS_PER_MS);
	for (int c = 1; c <= 2; c++) { /* the second is tried although the first stays away */
		assert_in_range(station->captures[c].lost_since_ns, before_ns, clock_now_ns());
		assert_non_null(strstr(station->captures[c].lost_why, "not there: plug it in"));
	}
	faults[2] = FAULT_NONE;
	run_for(station, 200 * NS_PER_MS);
	assert_int_equal(station->captures[1].state, CAPTURE_LOST);
	assert_int_equal(station->captures[2].state, CAPTURE_RUNNING);
	assert_int_equal(station->captures[2].lost_since_ns, 0);
	end_station(station);
}

static void it_starts_and_stops_again_and_again(void **state)
{
	struct station *station = start_station();
	struct diag diag = {0};

	(void)state;
	for (uint32_t run = 2; run < 6; run++) {
		assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_RUNNING);
		assert_true(station_stop(station));
		assert_false(station_stop(station));
		assert_int_equal(station->state, STATION_CONFIGURED);
		while (station_next_set(station))
			station_pop_set(station);
		assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
		run_for(station, 100 * NS_PER_MS);
		const struct marker_set *set = station_next_set(station);
		uint64_t shots = station->solver.shots;
		assert_in_range(shots, 2, 12); /* of this run alone */
		assert_int_equal(station->solver.incomplete, 0);
		assert_int_equal(station->run, run);
		if (set)
			assert_int_equal(set->run, run);
	}
	diag_finish(&diag);
	end_station(station);
}

static void calibrating_captures_without_solving(void **state)
{
	struct station *station = start_station();
	struct diag diag = {0};

	(void)state;
	assert_int_equal(station_start(station, STATION_CALIBRATE, &diag), EXIT_CODE_RUNNING);
	station_stop(station);
	while (station_next_set(station))
		station_pop_set(station);
	assert_int_equal(station_start(station, STATION_CALIBRATE, &diag), EXIT_CODE_OK);
	assert_int_equal(station->state, STATION_CALIBRATING);
	capture_request_preview(&station->captures[1]);
	run_for(station, 150 * NS_PER_MS);
	assert_int_equal(station->captures[1].preview.state, PREVIEW_READY);
	assert_true(station->captures[1].counters.frames > 5);
	assert_true(station->solver.shots > 5);
	assert_null(station_next_set(station));
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_RUNNING);
	assert_true(station_stop(station));
	diag_finish(&diag);
	end_station(station);
}

static void a_camera_that_went_away_while_stopped_is_lost_and_comes_back(void **state)
{
	struct station *station = start_station();
	struct diag diag = {0};

	(void)state;
	station_stop(station);
	faults[3] = FAULT_GONE;
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
	assert_int_equal(station->captures[3].state, CAPTURE_LOST);
	assert_non_null(strstr(station->captures[3].lost_why, "does not start"));
	run_for(station, 100 * NS_PER_MS);
	station_stop(station);
	assert_int_equal(station->captures[3].state, CAPTURE_LOST);
	assert_int_equal(station_start(station, STATION_START, &diag), EXIT_CODE_OK);
	faults[3] = FAULT_NONE;
	run_for(station, 200 * NS_PER_MS);
	assert_int_equal(station->captures[3].state, CAPTURE_RUNNING);
	diag_finish(&diag);
	end_station(station);
}

static void the_end_of_all_recordings_leaves_the_station_up(void **state)
{
	struct station *station = start_station();

	(void)state;
	for (int c = 0; c < CAMERA_COUNT; c++)
		faults[c] = FAULT_OVER;
	run_for(station, 150 * NS_PER_MS);
	assert_int_equal(station->state, STATION_ENDED);
	assert_int_equal(station->captures[0].state, CAPTURE_ENDED);
	end_station(station);
}

static void every_loss_is_counted_by_its_cause(void **state)
{
	struct station *station = start_station();
	struct capture_counters *counters = &station->captures[1].counters;

	(void)state;
	shots_with_fault(station, FAULT_DAMAGED, 100 * NS_PER_MS);
	assert_in_range(counters->damaged, 4, 20);
	shots_with_fault(station, FAULT_FOREIGN_CLOCK, 100 * NS_PER_MS);
	assert_in_range(counters->wrong_time, 4, 20);
	shots_with_fault(station, FAULT_OTHER_SIZE, 100 * NS_PER_MS);
	assert_in_range(counters->wrong_size, 4, 20);
	/* the damaged ones never came with a number, so they are gaps too */
	uint64_t gaps = counters->device_gaps;
	shots_with_fault(station, FAULT_GAPS, 200 * NS_PER_MS);
	assert_in_range(counters->device_gaps - gaps, 5, 20);
	_Atomic uint64_t *repeated = &station->solver.book.cameras[1].counts[LEDGER_REPEATED];
	uint64_t repeats = *repeated;
	shots_with_fault(station, FAULT_REPEAT, 100 * NS_PER_MS);
	assert_in_range(*repeated - repeats, 4, 20);
	end_station(station);
}

static void one_camera_that_is_not_there_leaves_none_open(void **state)
{
	struct station *station = calloc(1, sizeof(*station));
	struct diag diag = {0};

	(void)state;
	faults[2] = FAULT_GONE;
	assert_int_equal(station_load(station, config_path, &diag), EXIT_CODE_OK);
	assert_int_equal(station_configure(station, &diag), EXIT_CODE_DEVICE);
	assert_non_null(strstr(diag.text, "fake:2"));
	assert_int_equal(open_count, 0);
	assert_int_equal(station->state, STATION_IDLE);
	diag_finish(&diag);
	free(station);
}

static void a_station_that_nobody_listens_to_keeps_the_oldest_sets(void **state)
{
	struct station *station = start_station();
	uint64_t lost = station->solver.lost;

	(void)state;
	clock_rush_begin(); /* the control thread hangs */
	clock_sleep_until(clock_now_ns() + 600 * NS_PER_MS);
	clock_rush_end();
	assert_true(station->solver.lost > lost);
	assert_in_range(ring_count(&station->solver.sets), 32, 64);
	const struct marker_set *set = station_next_set(station);
	uint64_t first = set->shot;
	station_pop_set(station);
	assert_int_equal(station_next_set(station)->shot, first + 1);
	end_station(station);
}

static void assert_holds(const struct ring *ring, int64_t period_ns)
{
	assert_true(ring->capacity * period_ns >= 250 * NS_PER_MS);
}

static void queues_hold_a_quarter_of_a_second_also_of_cameras_that_run_faster(void **state)
{
	(void)state;
	granted_period_ns = PERIOD_NS / 2;
	struct station *station = start_station();
	granted_period_ns = 0;
	for (int c = 0; c < CAMERA_COUNT; c++)
		assert_holds(&station->captures[c].sets, PERIOD_NS / 2);
	assert_holds(&station->solver.sets, PERIOD_NS / 2);
	end_station(station);
}

static int make_stage(void **state)
{
	const char *addresses[CAMERA_COUNT] = {"fake:0", "fake:1", "fake:2", "fake:3"};
	struct sim_options options = {.camera_count = CAMERA_COUNT, .rate_hz = 100};
	struct sim_scene *scene;
	struct diag diag = {0};

	(void)state;
	if (!mkdtemp(stage_dir) || sim_scene_create(&scene, &options, &diag) < 0)
		return -1;
	int err = sim_scene_write_stage(scene, stage_dir, addresses,
					"calibration: {rate_hz: 120}\n", &diag);
	sim_scene_destroy(scene);
	snprintf(config_path, sizeof(config_path), "%s/stage.yaml", stage_dir);
	diag_finish(&diag);
	return err;
}

static int remove_stage(void **state)
{
	char command[PATH_MAX];

	(void)state;
	snprintf(command, sizeof(command), "rm -r %s", stage_dir);
	return system(command);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_silent_camera_stalls_nobody),
		cmocka_unit_test(a_camera_that_speaks_again_is_waited_for_again),
		cmocka_unit_test(shots_begin_when_all_cameras_run),
		cmocka_unit_test(a_vanished_camera_comes_back_by_itself),
		cmocka_unit_test(every_lost_camera_says_since_when_and_why),
		cmocka_unit_test(it_starts_and_stops_again_and_again),
		cmocka_unit_test(calibrating_captures_without_solving),
		cmocka_unit_test(a_camera_that_went_away_while_stopped_is_lost_and_comes_back),
		cmocka_unit_test(the_end_of_all_recordings_leaves_the_station_up),
		cmocka_unit_test(every_loss_is_counted_by_its_cause),
		cmocka_unit_test(one_camera_that_is_not_there_leaves_none_open),
		cmocka_unit_test(queues_hold_a_quarter_of_a_second_also_of_cameras_that_run_faster),
		cmocka_unit_test(a_station_that_nobody_listens_to_keeps_the_oldest_sets),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, make_stage, remove_stage);
}
