/*
 * See gige_camera.h.
 */
#include "tests/contract/gige_camera.h"

#include <errno.h>
#include <glob.h>
#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"

#define BUSY_NS NS_PER_MS
#define POOL_NS (NS_PER_S / 2)

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

/* Time for which threads of a process stood ready and did not run, by the kernel's account. */
static int64_t waited_ns(pid_t pid)
{
	char pattern[64];
	int64_t sum_ns = 0;
	glob_t tasks;

	snprintf(pattern, sizeof(pattern), "/proc/%d/task/[0-9]*/schedstat", (int)pid);
	if (glob(pattern, 0, NULL, &tasks))
		return 0;
	for (size_t t = 0; t < tasks.gl_pathc; t++) {
		FILE *file = fopen(tasks.gl_pathv[t], "re");
		int64_t ran_ns, stood_ns;

		if (file && fscanf(file, "%" SCNd64 " %" SCNd64, &ran_ns, &stood_ns) == 2)
			sum_ns += stood_ns;
		if (file)
			fclose(file);
	}
	globfree(&tasks);
	return sum_ns;
}

/* Of what is in the pool now some came up to a quarter of a second ago. */
static bool machine_was_busy(const struct gige_child *child)
{
	static int64_t before_ns, busy_ns = -POOL_NS;
	int64_t now_ns = clock_now_ns(), sum_ns = waited_ns(getpid()) + waited_ns(child->pid);

	if (sum_ns - before_ns > BUSY_NS)
		busy_ns = now_ns;
	before_ns = sum_ns;
	return now_ns - busy_ns < POOL_NS;
}

int gige_camera_acquire(struct camera *camera, const struct gige_child *child, int64_t timeout_ns,
			struct frame *frame)
{
	int error;

	do
		error = driver->acquire(camera, timeout_ns, frame);
	while (machine_was_busy(child) && error == -EBADMSG);
	return error;
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
