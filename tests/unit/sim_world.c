/*
 * The in-process cameras and the trigger of the simulated stage.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "sim/world/world.h"
#include "track/observe.h"

static const struct sim_options OPTIONS = {.seed = 1};
#define PERIOD_NS 8333333

static int open_world(void **state)
{
	(void)state;
	return sim_world_open(&OPTIONS, 0, NULL);
}

static int close_world(void **state)
{
	(void)state;
	sim_world_close();
	return 0;
}

static struct camera *open_camera(const char *name)
{
	struct camera *camera = NULL;

	assert_int_equal(sim_camera_driver.open(&camera, name, NULL, NULL), 0);
	assert_int_equal(sim_camera_driver.start(camera, NULL), 0);
	return camera;
}

static void close_camera(struct camera *camera)
{
	sim_camera_driver.stop(camera);
	sim_camera_driver.close(camera);
}

static void frames_come_after_their_exposure_and_in_order(void **state)
{
	struct camera *camera = open_camera("ir1");
	struct frame frame;
	uint64_t last = 0;

	(void)state;
	for (int i = 0; i < 20; i++) {
		assert_int_equal(sim_camera_driver.acquire(camera, NS_PER_S, &frame), 0);
		assert_int_equal(
			frame.mid_exposure_ns,
			sim_world_epoch_ns() +
				sim_scene_mid_exposure_ns(sim_world_scene(), frame.device_seq));
		assert_true(frame.arrival_ns > frame.mid_exposure_ns);
		assert_true(clock_now_ns() >= frame.arrival_ns);
		assert_true(frame.shot == SHOT_UNKNOWN);
		assert_true(i == 0 || frame.device_seq > last);
		assert_int_equal(frame.width_px * frame.height_px, 1280 * 1024);
		last = frame.device_seq;
		sim_camera_driver.release(camera, &frame);
	}
	close_camera(camera);
}

static void late_station_gets_the_last_eight_and_sees_the_gap(void **state)
{
	struct sim_options slow = {.seed = 1, .rate_hz = 30}; /* so that a busy machine keeps up */
	struct camera *camera;
	struct frame frame;

	(void)state;
	sim_world_close();
	assert_int_equal(sim_world_open(&slow, 0, NULL), 0);
	camera = open_camera("ir0");
	int64_t period_ns = sim_scene_period_ns(sim_world_scene());

	assert_int_equal(sim_camera_driver.acquire(camera, NS_PER_S, &frame), 0);
	uint64_t before = frame.device_seq;

	sim_camera_driver.release(camera, &frame);
	clock_sleep_until(clock_now_ns() + 15 * period_ns);
	int64_t woken_ns = clock_now_ns();

	assert_int_equal(sim_camera_driver.acquire(camera, NS_PER_S, &frame), 0);
	assert_true(frame.device_seq >= before + 8);
	int64_t age_ns = woken_ns - frame.mid_exposure_ns;

	assert_true(age_ns > 6 * period_ns); /* queued, not the newest */
	uint64_t first = frame.device_seq;

	for (uint64_t i = 1; i < 6; i++) { /* the queue comes without waiting or gaps */
		sim_camera_driver.release(camera, &frame);
		assert_int_equal(sim_camera_driver.acquire(camera, 0, &frame), 0);
		assert_int_equal(frame.device_seq, first + i);
	}
	close_camera(camera);
}

static void acquire_honours_its_timeout(void **state)
{
	struct camera *camera;
	struct frame frame;
	int64_t epoch_ns = clock_now_ns() + 10 * NS_PER_S;

	(void)state;
	sim_world_close();
	assert_int_equal(sim_world_open(&OPTIONS, epoch_ns, NULL), 0);
	camera = open_camera("ir0");
	int64_t start_ns = clock_now_ns();

	assert_int_equal(sim_camera_driver.acquire(camera, 5 * NS_PER_MS, &frame), -ETIMEDOUT);
	assert_true(clock_now_ns() - start_ns >= 5 * NS_PER_MS);
	assert_true(clock_now_ns() - start_ns < NS_PER_S);
	close_camera(camera);
}

static void unknown_camera_is_told_the_names(void **state)
{
	struct camera *camera = NULL;
	struct diag diag = {0};

	(void)state;
	assert_int_equal(sim_camera_driver.open(&camera, "ir9", NULL, &diag), -ENODEV);
	assert_null(camera);
	assert_non_null(strstr(diag.text, "ir9"));
	assert_non_null(strstr(diag.text, "ir0 ir1 ir2 ir3"));
	diag_finish(&diag);
	sim_camera_driver.close(NULL);
}

static void devices_need_an_open_world(void **state)
{
	struct camera *camera = NULL;
	struct trigger *trigger = NULL;
	struct diag diag = {0};

	(void)state;
	assert_int_equal(sim_world_open(&OPTIONS, 0, &diag), -EBUSY);
	sim_world_close();
	assert_int_equal(sim_camera_driver.open(&camera, "ir0", NULL, &diag), -ENODEV);
	assert_int_equal(sim_trigger_driver.open(&trigger, "", &diag), -ENODEV);
	assert_int_equal(diag.count, 3);
	diag_finish(&diag);
}

static void count_found(const struct camera_info *info, void *user)
{
	assert_int_equal(strncmp(info->address, "sim:ir", 6), 0);
	++*(int *)user;
}

static void every_camera_is_listed_and_grants_its_size(void **state)
{
	struct camera *camera = open_camera("ir3");
	struct camera_mode wanted = {.width_px = 640, .triggered = true}, granted;
	int found = 0;

	(void)state;
	assert_int_equal(sim_camera_driver.list(count_found, &found, NULL), 0);
	assert_int_equal(found, 4);
	assert_int_equal(sim_camera_driver.configure(camera, &wanted, &granted, NULL), 0);
	assert_int_equal(granted.width_px, 1280);
	assert_int_equal(granted.height_px, 1024);
	assert_int_equal(granted.period_ns, PERIOD_NS);
	close_camera(camera);
}

/* Strobe 100..600 us inside an exposure of 0..1000 us: the light's middle is 350 us. */
static const struct trigger_plan PLAN = {.period_ns = PERIOD_NS,
					 .ir_exposure_ns = 1000 * NS_PER_US,
					 .strobe_delay_ns = 100 * NS_PER_US,
					 .strobe_width_ns = 500 * NS_PER_US,
					 .hd_divider = 4};

static void edges_lead_to_the_mid_exposure_of_their_shot(void **state)
{
	struct trigger *trigger = NULL;
	struct edge edge;
	uint64_t last = 0;

	(void)state;
	assert_int_equal(sim_trigger_driver.open(&trigger, "", NULL), 0);
	assert_int_equal(sim_trigger_driver.next(trigger, 0, &edge), -ENODEV);
	assert_int_equal(sim_trigger_driver.arm(trigger, &PLAN, NULL), 0);
	assert_int_equal(sim_trigger_driver.next(trigger, 0, &edge), -ETIMEDOUT);
	for (int i = 0; i < 10; i++) {
		assert_int_equal(sim_trigger_driver.next(trigger, NS_PER_S, &edge), 0);
		assert_int_equal(edge.edge_ns + 350 * NS_PER_US,
				 sim_world_epoch_ns() +
					 sim_scene_mid_exposure_ns(sim_world_scene(), edge.shot));
		assert_true(clock_now_ns() >= edge.edge_ns);
		assert_true(i == 0 || edge.shot == last + 1);
		last = edge.shot;
	}
	sim_trigger_driver.disarm(trigger);
	sim_trigger_driver.close(trigger);
}

static void plan_of_another_rate_is_refused(void **state)
{
	struct trigger *trigger = NULL;
	struct trigger_plan plan = PLAN;
	struct diag diag = {0};

	(void)state;
	plan.period_ns = NS_PER_S / 60;
	assert_int_equal(sim_trigger_driver.open(&trigger, "", NULL), 0);
	assert_int_equal(sim_trigger_driver.arm(trigger, &plan, &diag), -EINVAL);
	assert_non_null(strstr(diag.text, "120 Hz"));
	diag_finish(&diag);
	sim_trigger_driver.close(trigger);
}

#define WITH_WORLD(test) cmocka_unit_test_setup_teardown(test, open_world, close_world)

int main(void)
{
	const struct CMUnitTest tests[] = {
		WITH_WORLD(frames_come_after_their_exposure_and_in_order),
		WITH_WORLD(late_station_gets_the_last_eight_and_sees_the_gap),
		WITH_WORLD(acquire_honours_its_timeout),
		WITH_WORLD(unknown_camera_is_told_the_names),
		WITH_WORLD(devices_need_an_open_world),
		WITH_WORLD(every_camera_is_listed_and_grants_its_size),
		WITH_WORLD(edges_lead_to_the_mid_exposure_of_their_shot),
		WITH_WORLD(plan_of_another_rate_is_refused),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
