/*
 * What the aravis driver makes of a camera's features, on Aravis' camera inside this process: it
 * has no IP address, and its description is one that a test has written.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <arv.h>

#include "base/clock.h"
#include "drivers/aravis/aravis.h"

#define ENTRY(name, value) "<EnumEntry Name=\"" name "\"><Value>" #value "</Value></EnumEntry>"
#define FORMATS_BEGIN "<Enumeration Name=\"PixelFormat\" NameSpace=\"Standard\">"
#define FORMATS_END "<pValue>PixelFormatRegister</pValue>"
#define MONO12 ENTRY("Mono12", 17825797)
#define MONO16 ENTRY("Mono16", 17825799)
#define MONO12_PACKED ENTRY("Mono12Packed", 17563654)
#define ROLLING                                                       \
	"<Enumeration Name=\"SensorShutterMode\">" ENTRY("Global", 0) \
		ENTRY("Rolling", 1) "<Value>1</Value></Enumeration>"

static const struct camera_driver *const driver = &aravis_camera_driver;
static char path[] = "/tmp/stage-test-genicam-XXXXXX";
static char *own_xml; /* of the camera, as Aravis has it */

static int set_up(void **state)
{
	size_t size = 0;

	(void)state;
	arv_enable_interface("Fake");
	arv_disable_interface("GigEVision"); /* whose discovery takes a second */
	ArvCamera *camera = arv_camera_new("Fake_1", NULL);

	if (!camera || close(mkstemp(path)))
		return -1;
	const char *xml = arv_device_get_genicam_xml(arv_camera_get_device(camera), &size);

	own_xml = strndup(xml, size);
	g_object_unref(camera);
	return own_xml ? 0 : -1;
}

static int tear_down(void **state)
{
	(void)state;
	free(own_xml);
	return unlink(path);
}

/* The camera's description, with `formats` for its own when not NULL, and `features` added. */
static void describe(const char *formats, const char *features)
{
	const char *begin = strstr(own_xml, FORMATS_BEGIN), *end = strstr(own_xml, FORMATS_END);
	const char *last = strstr(own_xml, "</RegisterDescription>");
	FILE *file = fopen(path, "we");

	assert_true(file && begin && end && last && begin < end && end < last);
	begin += strlen(FORMATS_BEGIN);
	fwrite(own_xml, 1, (size_t)((formats ? begin : end) - own_xml), file);
	fputs(formats ? formats : "", file);
	fwrite(end, 1, (size_t)(last - end), file);
	fprintf(file, "%s%s", features, last);
	assert_int_equal(fclose(file), 0);
	arv_set_fake_camera_genicam_filename(path);
}

static int configure(struct camera **camera, struct camera_mode *mode, struct diag *diag)
{
	int error = driver->open(camera, "Fake_1", NULL, diag);

	assert_int_equal(error, 0);
	return driver->configure(*camera, mode, mode, diag);
}

static void colour_camera_lends_bayer_rows(void **state)
{
	struct camera_mode mode = {.format = PIXEL_BAYER_RG8};
	struct diag diag = {0};
	struct camera *camera;
	struct frame frame;

	(void)state;
	describe(NULL, "");
	assert_int_equal(configure(&camera, &mode, &diag), 0);
	assert_int_equal(mode.format, PIXEL_BAYER_RG8);
	assert_int_equal(driver->start(camera, &diag), 0);
	assert_int_equal(driver->acquire(camera, 2 * NS_PER_S, &frame), 0);
	assert_int_equal(frame.format, PIXEL_BAYER_RG8);
	assert_int_equal(frame.stride_bytes, mode.width_px);
	driver->release(camera, &frame);
	driver->stop(camera);
	driver->close(camera);
	assert_int_equal(diag.count, 0);
}

static void camera_of_words_lends_them_with_their_bits(void **state)
{
	struct camera_mode mode = {.format = PIXEL_GREY8};
	struct diag diag = {0};
	struct camera *camera;
	struct frame frame;

	(void)state;
	describe(MONO12_PACKED MONO16, "");
	assert_int_equal(configure(&camera, &mode, &diag), 0);
	assert_int_equal(mode.format, PIXEL_GREY16);
	assert_int_equal(mode.bits, 16);
	assert_int_equal(driver->start(camera, &diag), 0);
	assert_int_equal(driver->acquire(camera, 2 * NS_PER_S, &frame), 0);
	assert_int_equal(frame.format, PIXEL_GREY16);
	assert_int_equal(frame.bits, 16);
	assert_int_equal(frame.stride_bytes, 2 * mode.width_px);
	driver->release(camera, &frame);
	driver->stop(camera);
	driver->close(camera);
}

static void bits_choose_among_formats_of_words(void **state)
{
	struct camera_mode any = {.format = PIXEL_GREY16},
			   ten = {.format = PIXEL_GREY16, .bits = 10};
	struct diag diag = {0};
	struct camera *camera;

	(void)state;
	describe(MONO16 MONO12 MONO12_PACKED, "");
	assert_int_equal(configure(&camera, &any, &diag), 0);
	assert_int_equal(any.bits, 12);
	assert_int_equal(driver->configure(camera, &ten, &ten, &diag), -ENOTSUP);
	diag_finish(&diag);
	driver->close(camera);
}

static void packed_pixels_are_refused_with_what_the_camera_offers(void **state)
{
	struct camera_mode mode = {.format = PIXEL_GREY8};
	struct diag diag = {0};
	struct camera *camera;

	(void)state;
	describe(MONO12_PACKED, "");
	assert_int_equal(configure(&camera, &mode, &diag), -ENOTSUP);
	assert_int_equal(diag.count, 1);
	assert_non_null(strstr(diag.text, "aravis:Fake_1"));
	assert_non_null(strstr(diag.text, "Mono12Packed"));
	assert_non_null(strstr(diag.text, "Mono8"));
	diag_finish(&diag);
	driver->close(camera);
}

static void rolling_shutter_tells_the_time_between_its_rows(void **state)
{
	struct camera_mode mode = {.readout_ns = 5120000}, global = {0};
	struct diag diag = {0};
	struct camera *camera;

	(void)state;
	describe(NULL, ROLLING);
	assert_int_equal(configure(&camera, &mode, &diag), 0);
	assert_int_equal(mode.row_time_ns, 5120000 / mode.height_px);
	driver->close(camera);
	describe(NULL, "");
	assert_int_equal(configure(&camera, &global, &diag), 0);
	assert_int_equal(global.row_time_ns, 0);
	driver->close(camera);
	global = (struct camera_mode){.shutter = SHUTTER_ROLLING, .row_time_ns = 12000};
	assert_int_equal(configure(&camera, &global, &diag), 0);
	assert_int_equal(global.row_time_ns, 12000); /* it does not tell itself */
	driver->close(camera);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(colour_camera_lends_bayer_rows),
		cmocka_unit_test(camera_of_words_lends_them_with_their_bits),
		cmocka_unit_test(bits_choose_among_formats_of_words),
		cmocka_unit_test(packed_pixels_are_refused_with_what_the_camera_offers),
		cmocka_unit_test(rolling_shutter_tells_the_time_between_its_rows),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
