/*
 * Addresses lead to drivers, and a wrong one is told what there is.
 */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/files/files.h"
#include "drivers/trigger_free.h"

static const struct camera_driver sim_like = {.name = "sim"};
static const struct camera_driver *const cameras[] = {&files_camera_driver, &sim_like, NULL};
static const struct trigger_driver *const triggers[] = {&free_trigger_driver, NULL};

static void an_address_is_driver_colon_device(void **state)
{
	const char *rest = NULL;
	struct diag diag = {0};

	(void)state;
	assert_ptr_equal(camera_driver_find(cameras, "sim:ir3", &rest, &diag), &sim_like);
	assert_string_equal(rest, "ir3");
	assert_ptr_equal(camera_driver_find(cameras, "files:a:b/c", &rest, &diag),
			 &files_camera_driver);
	assert_string_equal(rest, "a:b/c");
	assert_null(diag.text);
}

static void wrong_addresses_are_told_the_drivers(void **state)
{
	static const char *const wrong[] = {"", "sim", "sim:", "simx:1", "si:1", ":1"};
	const char *rest = "untouched";

	(void)state;
	for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
		struct diag diag = {0};

		assert_null(camera_driver_find(cameras, wrong[i], &rest, &diag));
		assert_non_null(strstr(diag.text, "the drivers are files, sim\n"));
		assert_string_equal(rest, "untouched");
		diag_finish(&diag);
	}
}

static void a_trigger_needs_no_device(void **state)
{
	const char *rest = NULL;
	struct diag diag = {0};

	(void)state;
	assert_ptr_equal(trigger_driver_find(triggers, "free", &rest, &diag), &free_trigger_driver);
	assert_string_equal(rest, "");
	assert_null(trigger_driver_find(triggers, "gpio:4", &rest, &diag));
	assert_string_equal(diag.text, "trigger gpio:4: no such trigger; there are free\n");
	diag_finish(&diag);
}

static void the_free_trigger_never_fires(void **state)
{
	const struct trigger_plan plan = {.period_ns = 8333333,
					  .ir_exposure_ns = 250000,
					  .hd_divider = 4},
				  no_plan = {0};
	struct trigger *trigger = NULL;
	struct diag diag = {0};
	struct edge edge;

	(void)state;
	assert_int_equal(free_trigger_driver.open(&trigger, "x", &diag), -EINVAL);
	assert_null(trigger);
	assert_int_equal(free_trigger_driver.open(&trigger, "", NULL), 0);
	assert_int_equal(free_trigger_driver.arm(trigger, &no_plan, &diag), -EINVAL);
	assert_int_equal(diag.count, 2);
	assert_int_equal(free_trigger_driver.arm(trigger, &plan, NULL), 0);
	int64_t start_ns = clock_now_ns();
	assert_int_equal(free_trigger_driver.next(trigger, 5 * NS_PER_MS, &edge), -ETIMEDOUT);
	assert_true(clock_now_ns() - start_ns >= 5 * NS_PER_MS);
	free_trigger_driver.disarm(trigger);
	free_trigger_driver.close(trigger);
	free_trigger_driver.close(NULL);
	diag_finish(&diag);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_address_is_driver_colon_device),
		cmocka_unit_test(wrong_addresses_are_told_the_drivers),
		cmocka_unit_test(a_trigger_needs_no_device),
		cmocka_unit_test(the_free_trigger_never_fires),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
