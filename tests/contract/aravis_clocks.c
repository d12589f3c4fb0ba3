/*
 * Which clock the aravis driver believes, on simulated cameras that follow PTP, or cannot; and from
 * which socket it takes pictures. Truth is the scene: pulse n at epoch + n periods.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <linux/capability.h>
#include <sys/syscall.h>

#include "base/clock.h"
#include "sim/world/scene.h"
#include "tests/contract/gige_camera.h"
#include "tests/tap_case.h"

#define RATE_HZ 50.0
#define FRAMES 60
#define WAIT_NS NS_PER_S
#define BOUND_NS (2 * NS_PER_MS) /* of a reading on a busy machine; 0.2 ms else */

static const struct camera_driver *const driver = &aravis_camera_driver;
static struct gige_child ours, other, none; /* PTP of our master, of another, no PTP */
static int64_t epoch_ns, period_ns, first_ns;

static int start_child(struct gige_child *child, uint32_t block, const char *master_ahead_ns)
{
	char epoch[32];
	const char *extra[] = {
		"--rate",        "50", "--epoch-ns", epoch, master_ahead_ns ? "--ptp" : NULL,
		master_ahead_ns, NULL};

	snprintf(epoch, sizeof(epoch), "%" PRId64, epoch_ns);
	return gige_child_start(child, gige_program, block, extra, gige_log_path);
}

static int set_up(void **state)
{
	struct sim_options options = {.seed = 1, .camera_count = 4, .rate_hz = RATE_HZ};
	struct sim_scene *scene;

	(void)state;
	epoch_ns = clock_now_ns();
	if (sim_scene_create(&scene, &options, NULL))
		return -1;
	period_ns = sim_scene_period_ns(scene);
	first_ns = epoch_ns + sim_scene_mid_exposure_ns(scene, 0);
	sim_scene_destroy(scene);
	return start_child(&ours, 0, "0") || start_child(&other, 1, "37000000000") ||
	       start_child(&none, 2, NULL);
}

static int tear_down(void **state)
{
	(void)state;
	gige_child_end(&ours, SIGTERM);
	gige_child_end(&other, SIGTERM);
	gige_child_end(&none, SIGTERM);
	return unlink(gige_log_path);
}

static struct camera *start(const struct gige_child *child, enum camera_clock clock,
			    enum camera_receive receive)
{
	struct camera *camera = gige_camera_open(child, 0);
	struct camera_mode mode = {.format = PIXEL_GREY8,
				   .triggered = true,
				   .shutter = SHUTTER_GLOBAL,
				   .clock = clock,
				   .receive = receive};
	struct diag diag = {0};

	assert_int_equal(driver->configure(camera, &mode, &mode, &diag), 0);
	assert_int_equal(driver->start(camera, &diag), 0);
	diag_finish(&diag);
	return camera;
}

static struct camera_fact fact(const struct camera *camera, const char *name)
{
	struct camera_fact facts[CAMERA_FACT_MAX];
	int count = driver->facts(camera, facts);

	for (int i = 0; i < count; i++)
		if (strcmp(facts[i].name, name) == 0)
			return facts[i];
	fail_msg("no fact %s", name);
	return facts[0];
}

/* Every frame's time is that of its pulse, to its bound. Returns the widest. A small socket on a
 * busy machine damages some. */
static int64_t check_times(struct camera *camera)
{
	int64_t widest_ns = 0, last_ns = 0;
	int damaged = 0;

	for (int i = 0; i < FRAMES; i++) {
		struct frame frame;
		int error = driver->acquire(camera, WAIT_NS, &frame);

		damaged += error == -EBADMSG;
		assert_true(!error || (error == -EBADMSG && damaged < FRAMES / 2));
		if (error)
			continue;
		int64_t since_ns = frame.mid_exposure_ns - first_ns;
		int64_t off_ns = since_ns - (since_ns + period_ns / 2) / period_ns * period_ns;

		assert_true(llabs(off_ns) <= frame.uncertainty_ns);
		assert_true(frame.mid_exposure_ns > last_ns);
		last_ns = frame.mid_exposure_ns;
		if (frame.uncertainty_ns > widest_ns)
			widest_ns = frame.uncertainty_ns;
		driver->release(camera, &frame);
	}
	return widest_ns;
}

static void check_clock(const struct gige_child *child, enum camera_clock clock, bool falls_short,
			const char *words)
{
	struct camera *camera = start(child, clock, CAMERA_RECEIVE_SOCKET);
	int64_t widest_ns = check_times(camera);
	struct camera_fact told = fact(camera, "clock");

	if (!strstr(told.text, words))
		fail_msg("'%s' is not in: %s", words, told.text);
	assert_int_equal(told.falls_short, falls_short);
	assert_true(widest_ns <= BOUND_NS);
	gige_camera_stop(camera);
}

static void a_camera_of_our_own_master_is_believed(void **state)
{
	(void)state;
	check_clock(&ours, CAMERA_CLOCK_PTP, false, "PTP Slave");
}

static void a_camera_of_another_master_is_mapped_and_its_distance_told(void **state)
{
	(void)state;
	check_clock(&other, CAMERA_CLOCK_PTP, true, "mapped: PTP Slave, +37.0");
}

static void a_camera_without_ptp_is_mapped_and_that_is_told(void **state)
{
	(void)state;
	check_clock(&none, CAMERA_CLOCK_PTP, true, "the camera has no PTP");
}

static void nobody_follows_ptp_unasked(void **state)
{
	(void)state;
	check_clock(&ours, CAMERA_CLOCK_DEVICE, false, "its own, mapped");
}

static void pictures_come_from_a_packet_socket_where_it_is_permitted(void **state)
{
	struct camera *camera;

	(void)state;
	camera = start(&none, CAMERA_CLOCK_DEVICE, CAMERA_RECEIVE_PACKETS);
	check_times(camera);
	struct camera_fact told = fact(camera, "receive");

	assert_string_equal(told.text, "from a packet socket");
	assert_false(told.falls_short);
	gige_camera_stop(camera);
}

static const char *packet_socket_lacks(void)
{
	int fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);

	if (fd < 0)
		return "a packet socket is not permitted";
	close(fd);
	return NULL;
}

/* Last: there is no way back. */
static void without_the_right_it_is_a_plain_socket_and_that_is_told(void **state)
{
	struct __user_cap_header_struct header = {.version = _LINUX_CAPABILITY_VERSION_3};
	struct __user_cap_data_struct nothing[2] = {0};
	struct camera *camera;

	(void)state;
	assert_int_equal(syscall(SYS_capset, &header, nothing), 0);
	camera = start(&none, CAMERA_CLOCK_DEVICE, CAMERA_RECEIVE_PACKETS);
	check_times(camera);
	struct camera_fact told = fact(camera, "receive");

	assert_non_null(strstr(told.text, "from a plain socket: a packet socket is not permitted"));
	assert_true(told.falls_short);
	gige_camera_stop(camera);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_camera_of_our_own_master_is_believed),
		cmocka_unit_test(a_camera_of_another_master_is_mapped_and_its_distance_told),
		cmocka_unit_test(a_camera_without_ptp_is_mapped_and_that_is_told),
		cmocka_unit_test(nobody_follows_ptp_unasked),
		unit_test_unless(packet_socket_lacks(),
				 pictures_come_from_a_packet_socket_where_it_is_permitted),
		cmocka_unit_test(without_the_right_it_is_a_plain_socket_and_that_is_told),
	};

	if (gige_take_program(argc, argv))
		return EXIT_FAILURE;
	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, set_up, tear_down);
}
