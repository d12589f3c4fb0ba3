/*
 * See gige_camera.h.
 */
#include "tests/contract/gige_camera.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const struct camera_driver *const driver = &aravis_camera_driver;

const char *gige_program;
char gige_log_path[] = "/tmp/stage-test-gige-XXXXXX";

int gige_take_program(int argc, char **argv)
{
	if (argc < 2 || close(mkstemp(gige_log_path))) {
		fprintf(stderr, "usage: %s PATH-OF-STAGE-SIM-GIGE\n", argv[0]);
		return -1;
	}
	gige_program = argv[1];
	return 0;
}

static void assert_fine(int error, struct diag *diag)
{
	diag_print(diag, stderr);
	diag_finish(diag);
	assert_int_equal(error, 0);
}

struct camera *gige_camera_open(const struct gige_child *child, uint32_t index)
{
	struct camera *camera = NULL;
	struct diag diag = {0};
	char address[16];

	gige_child_address(child, index, address);
	assert_fine(driver->open(&camera, address, NULL, &diag), &diag);
	return camera;
}

struct camera_mode gige_camera_start(struct camera *camera, bool triggered)
{
	struct camera_mode wanted = {
		.format = PIXEL_GREY8, .triggered = triggered, .shutter = SHUTTER_GLOBAL};
	struct camera_mode granted;
	struct diag diag = {0};
	int error = driver->configure(camera, &wanted, &granted, &diag);

	if (!error)
		error = driver->start(camera, &diag);
	assert_fine(error, &diag);
	return granted;
}

void gige_camera_stop(struct camera *camera)
{
	driver->stop(camera);
	driver->close(camera);
}

int64_t gige_camera_count(const struct camera *camera, const char *name)
{
	struct camera_count counts[CAMERA_COUNT_MAX];
	int count = driver->counts(camera, counts);

	for (int i = 0; i < count; i++)
		if (strcmp(counts[i].name, name) == 0)
			return (int64_t)counts[i].count;
	return -1;
}
