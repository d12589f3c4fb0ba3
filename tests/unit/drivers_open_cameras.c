/*
 * Which cameras may be IR cameras, by what their driver was granted.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/gpio/trigger_gpio.h"
#include "drivers/open_cameras.h"
#include "drivers/trigger_free.h"
#include "drivers/usb/trigger_usb.h"

static struct camera_mode offered, asked;
static struct camera opened;

static int stub_open(struct camera **out, const char *rest, const char *base_dir, struct diag *diag)
{
	(void)rest;
	(void)base_dir;
	(void)diag;
	*out = &opened;
	return 0;
}

static void stub_close(struct camera *camera)
{
	(void)camera;
}

static int stub_configure(struct camera *camera, const struct camera_mode *wanted,
			  struct camera_mode *granted, struct diag *diag)
{
	(void)camera;
	(void)diag;
	asked = *wanted;
	*granted = offered;
	return 0;
}

static const struct camera_driver stub = {
	.name = "stub", .open = stub_open, .close = stub_close, .configure = stub_configure};
static const struct camera_driver *const drivers[] = {&stub, NULL};

/* A sensor of 1000 rows, 4 us apart, exposed for 6 ms: all rows are open from 4 to 6 ms. */
static int open_rolling(enum camera_role role, int64_t delay_us, int64_t width_us,
			struct diag *diag)
{
	struct stage *stage = calloc(1, sizeof(*stage));
	struct open_camera camera;

	assert_non_null(stage);
	offered = (struct camera_mode){.width_px = 1000,
				       .height_px = 1000,
				       .exposure_ns = 6 * NS_PER_MS,
				       .row_time_ns = 4 * NS_PER_US};
	stage->config.camera_count = 1;
	stage->config.cameras[0].role = role;
	strcpy(stage->config.cameras[0].name, "ir0");
	strcpy(stage->config.cameras[0].address, "stub:0");
	stage->config.plan = (struct trigger_plan){.period_ns = 8 * NS_PER_MS,
						   .ir_exposure_ns = 6 * NS_PER_MS,
						   .strobe_delay_ns = delay_us * NS_PER_US,
						   .strobe_width_ns = width_us * NS_PER_US};
	int error = open_camera_by_config(&camera, stage, 0, drivers, 0, diag);

	free(stage);
	return error;
}

static void rolling_shutter_needs_a_strobe_while_all_rows_are_open(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(open_rolling(ROLE_IR, 4000, 2000, &diag), 0);
	assert_int_equal(diag.count, 0);
	assert_int_equal(open_rolling(ROLE_IR, 3900, 500, &diag), -EINVAL); /* too soon */
	assert_int_equal(open_rolling(ROLE_IR, 5600, 500, &diag), -EINVAL); /* too long */
	assert_int_equal(open_rolling(ROLE_IR, 4000, 0, &diag), -EINVAL);   /* none */
	assert_int_equal(diag.count, 3);
	assert_non_null(strstr(diag.text, "ir0"));
	assert_non_null(strstr(diag.text, "rolling shutter"));
	assert_non_null(strstr(diag.text, "global shutter"));
	diag_finish(&diag);
}

static void hd_camera_may_roll(void **state)
{
	struct diag diag = {0};

	(void)state;
	assert_int_equal(open_rolling(ROLE_HD, 0, 0, &diag), 0);
	assert_int_equal(diag.count, 0);
}

static void settings_of_a_network_are_refused_of_a_driver_without_one(void **state)
{
	struct stage *stage = calloc(1, sizeof(*stage));
	struct open_camera camera;
	struct diag diag = {0};

	(void)state;
	assert_non_null(stage);
	stage->config.camera_count = 1;
	strcpy(stage->config.cameras[0].name, "ir0");
	strcpy(stage->config.cameras[0].address, "stub:0");
	stage->config.cameras[0].wanted.clock = CAMERA_CLOCK_PTP;
	assert_int_equal(open_camera_by_config(&camera, stage, 0, drivers, 0, &diag), -EINVAL);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, "camera ir0: clock and receive"));
	diag_finish(&diag);
	free(stage);
}

static const struct trigger_driver *const triggers[] = {&free_trigger_driver, &gpio_trigger_driver,
							&usb_trigger_driver, NULL};

static bool waits_for_edges(const char *trigger, enum camera_role role)
{
	struct stage *stage = calloc(1, sizeof(*stage));
	struct open_camera camera;
	struct diag diag = {0};

	assert_non_null(stage);
	offered = (struct camera_mode){.width_px = 64, .height_px = 64};
	stage->config.camera_count = 1;
	stage->config.cameras[0].role = role;
	strcpy(stage->config.cameras[0].name, "c0");
	strcpy(stage->config.cameras[0].address, "stub:0");
	assert_int_equal(open_camera_by_config(&camera, stage, 0, drivers,
					       trigger_fires(triggers, trigger), &diag),
			 0);
	assert_int_equal(camera.wanted.triggered, asked.triggered);
	free(stage);
	return asked.triggered;
}

static void cameras_that_the_trigger_fires_wait_for_its_edges(void **state)
{
	static const struct {
		const char *trigger;
		bool ir, hd;
	} forms[] = {
		{"gpio:chip0,ir=A,strobe=B,hd=C", true, true},
		{"gpio:chip0,ir=A,strobe=B", true, false},
		{"gpio:chip0,strobe=B", false, false},
		{"gpio:chip0,genlock=IN", true, true}, /* by the source */
		{"gpio:chip0,genlock=IN,strobe=B", true, false},
		{"gpio:chip0,genlock=IN,ir=A,hd=C", true, true},
		{"gpio:chip0,ir=A,exposure=IN", true, false},
		{"usb", true, true}, /* by its usual lines */
		{"usb:FT1", true, true},
		{"usb:FT1,ir=D5", true, false},
		{"usb:strobe=D6,hd=D7", false, true},
		{"usb:FT1,ir=D9", false, false},
		{"gpio:", false, false},
		{"free", false, false},
		{"laser:ir=A", false, false},
	};

	(void)state;
	for (size_t i = 0; i < sizeof(forms) / sizeof(*forms); i++) {
		assert_int_equal(waits_for_edges(forms[i].trigger, ROLE_IR), forms[i].ir);
		assert_int_equal(waits_for_edges(forms[i].trigger, ROLE_HD), forms[i].hd);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rolling_shutter_needs_a_strobe_while_all_rows_are_open),
		cmocka_unit_test(hd_camera_may_roll),
		cmocka_unit_test(cameras_that_the_trigger_fires_wait_for_its_edges),
		cmocka_unit_test(settings_of_a_network_are_refused_of_a_driver_without_one),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
