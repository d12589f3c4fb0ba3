/*
 * The v4l2 driver on the kernel's uvcvideo: uvc_replug CAMERA-PROGRAM PICTURES STAGECTL plugs
 * emulated cameras in and out. Truth is the files with the pictures.
 */
#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "drivers/v4l2/v4l2.h"
#include "tests/hil/pictures.h"
#include "tests/hil/v4l2_stream.h"

#define PATIENCE_S 10

#define WATCH_PATIENCE_S 40 /* programs start slowly here */

static const char *program, *pictures_dir, *stagectl;
static struct pictures truth;
static const struct camera_mode wanted = {.format = PIXEL_GREY8, .period_ns = NS_PER_S / 10};

static pid_t plug_in(const char *bus, const char *serial)
{
	pid_t child = fork();

	if (child == 0) {
		execl(program, program, "--bus", bus, "--serial", serial, "--pictures",
		      pictures_dir, (char *)NULL);
		_exit(127);
	}
	assert_true(child > 0);
	return child;
}

static void unplug(pid_t camera)
{
	kill(camera, SIGKILL);
	waitpid(camera, NULL, 0);
}

static void look_for(const struct camera_info *info, void *wanted_address)
{
	const char **address = wanted_address;

	if (*address && strcmp(info->address, *address) == 0)
		*address = NULL;
}

/* Until the driver lists a camera of this serial number, which the kernel takes its time for. */
static void await(const char *serial)
{
	int64_t until_ns = clock_now_ns() + PATIENCE_S * NS_PER_S;
	char wanted_address[64];
	const char *address = wanted_address;
	struct diag diag = {0};

	snprintf(wanted_address, sizeof(wanted_address), "v4l2:serial=%s", serial);
	while (address && clock_now_ns() < until_ns) {
		v4l2_camera_driver.list(look_for, &address, &diag);
		clock_sleep_until(clock_now_ns() + 100 * NS_PER_MS);
	}
	diag_finish(&diag);
	assert_null(address);
}

static int picture_of(const struct frame *frame)
{
	for (uint32_t p = 0; p < truth.count; p++) {
		const uint8_t *picture = pictures_get(&truth, p);
		int y = 0;

		while (y < truth.height_px &&
		       memcmp(frame->pixels + (long)y * frame->stride_bytes,
			      picture + (long)y * truth.width_px, truth.width_px) == 0)
			y++;
		if (y == truth.height_px)
			return (int)p;
	}
	return -1;
}

/* Takes some frames: each one a whole picture, in the order in which the camera made them. */
static void check_frames(struct v4l2_stream *stream)
{
	uint64_t last_seq = 0;
	int last = -1;

	assert_int_equal(stream->mode.width_px, truth.width_px);
	assert_int_equal(stream->mode.period_ns, wanted.period_ns);
	for (int i = 0; i < 12; i++) {
		struct frame frame;

		assert_int_equal(v4l2_stream_next(stream, PATIENCE_S, &frame), 0);
		int picture = picture_of(&frame);

		assert_true(picture >= 0);
		if (i > 0 && frame.device_seq == last_seq + 1)
			assert_int_equal(picture, (last + 1) % (int)truth.count);
		last = picture;
		last_seq = frame.device_seq;
		v4l2_stream_release(stream, &frame);
	}
}

static int frames_until_gone(struct v4l2_stream *stream)
{
	struct frame frame;
	int err;

	while ((err = v4l2_stream_next(stream, PATIENCE_S, &frame)) == 0 || err == -EBADMSG)
		if (!err)
			v4l2_stream_release(stream, &frame);
	return err;
}

static void pictures_arrive_to_the_bit_and_in_order(void **state)
{
	pid_t camera = plug_in("0", "A1");
	struct v4l2_stream stream;

	(void)state;
	await("A1");
	v4l2_stream_start(&stream, "serial=A1", &wanted);
	check_frames(&stream);
	v4l2_stream_stop(&stream);
	unplug(camera);
}

static void an_unplugged_camera_is_gone_and_found_by_its_serial_number(void **state)
{
	pid_t first = plug_in("0", "A1"), other = plug_in("1", "B2");
	struct v4l2_stream stream;

	(void)state;
	await("A1");
	await("B2");
	v4l2_stream_start(&stream, "serial=A1", &wanted);
	check_frames(&stream);
	unplug(first);
	assert_int_equal(frames_until_gone(&stream), -ENODEV);
	v4l2_stream_stop(&stream);
	unplug(other);
	other = plug_in("0", "B2"); /* they change places */
	first = plug_in("1", "A1");
	await("A1");
	v4l2_stream_start(&stream, "serial=A1", &wanted);
	check_frames(&stream);
	v4l2_stream_stop(&stream);
	unplug(first);
	unplug(other);
}

static void a_stopped_camera_shows_nothing_old_when_it_starts_again(void **state)
{
	pid_t camera = plug_in("0", "A1");
	struct v4l2_stream stream;
	struct diag diag = {0};
	struct frame frame;

	(void)state;
	await("A1");
	v4l2_stream_start(&stream, "serial=A1", &wanted);
	for (int i = 0; i < 3; i++) {
		v4l2_camera_driver.stop(stream.camera);
		clock_sleep_until(clock_now_ns() + NS_PER_S);
		int64_t started_ns = clock_now_ns();

		assert_int_equal(v4l2_camera_driver.start(stream.camera, &diag), 0);
		assert_int_equal(v4l2_stream_next(&stream, PATIENCE_S, &frame), 0);
		assert_true(frame.mid_exposure_ns + frame.uncertainty_ns >=
			    started_ns - wanted.period_ns);
		assert_true(picture_of(&frame) >= 0);
		v4l2_stream_release(&stream, &frame);
	}
	diag_finish(&diag);
	v4l2_stream_stop(&stream);
	unplug(camera);
}

/* A running `stagectl camera list --watch`, and what it prints. */
static pid_t start_watch(FILE **out)
{
	int ends[2];

	assert_int_equal(pipe(ends), 0);
	pid_t child = fork();

	if (child == 0) {
		dup2(ends[1], STDOUT_FILENO);
		close(ends[0]);
		close(ends[1]);
		execl(stagectl, stagectl, "camera", "list", "--watch", "--json", (char *)NULL);
		_exit(127);
	}
	assert_true(child > 0);
	close(ends[1]);
	*out = fdopen(ends[0], "r");
	assert_non_null(*out);
	return child;
}

/* Until it says that `address` did so. */
static void await_event(FILE *watch, const char *event, const char *address)
{
	char line[512];

	alarm(WATCH_PATIENCE_S); /* ends the program: nothing else could be told */
	do
		assert_non_null(fgets(line, sizeof(line), watch));
	while (!strstr(line, event) || !strstr(line, address));
	alarm(0);
}

static void watching_the_list_names_departures_and_arrivals(void **state)
{
	pid_t camera = plug_in("0", "A1");
	FILE *watch;

	(void)state;
	await("A1");
	pid_t watcher = start_watch(&watch);

	await_event(watch, "present", "v4l2:serial=A1");
	unplug(camera);
	await_event(watch, "departed", "v4l2:serial=A1");
	camera = plug_in("0", "A1");
	await_event(watch, "arrived", "v4l2:serial=A1");
	unplug(camera);
	unplug(watcher);
	fclose(watch);
}

static const char doctors_config[] = "rig: none\nlayout: none.yaml\nrate_hz: 10\ncameras:\n"
				     "- {name: hd0, address: \"v4l2:serial=A1\", role: hd, "
				     "width: 640, height: 480, format: grey}\n";

/* The line of doctor's that holds `words`; "" without. */
static void ask_doctor(const char *words, char *line, size_t size)
{
	char config[] = "/tmp/doctorXXXXXX", command[512];
	int fd = mkstemp(config);

	assert_true(fd >= 0);
	assert_true(write(fd, doctors_config, strlen(doctors_config)) > 0);
	close(fd);
	snprintf(command, sizeof(command), "%s doctor %s --no-light --directory /tmp", stagectl,
		 config);
	FILE *doctor = popen(command, "r");

	assert_non_null(doctor);
	while (fgets(line, (int)size, doctor) && !strstr(line, words))
		*line = '\0';
	while (fgetc(doctor) != EOF)
		;
	pclose(doctor);
	unlink(config);
}

static void doctor_finds_the_camera_and_what_its_bus_carries(void **state)
{
	pid_t camera = plug_in("0", "A1");
	char line[512];

	(void)state;
	await("A1");
	ask_doctor("hd0, v4l2:serial=A1", line, sizeof(line));
	assert_non_null(strstr(line, "480 Mbit/s"));
	ask_doctor(" bus usb", line, sizeof(line));
	assert_non_null(strstr(line, "1 cameras"));
	unplug(camera);
	ask_doctor("hd0, v4l2:serial=A1", line, sizeof(line));
	assert_non_null(strstr(line, "problem"));
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pictures_arrive_to_the_bit_and_in_order),
		cmocka_unit_test(an_unplugged_camera_is_gone_and_found_by_its_serial_number),
		cmocka_unit_test(a_stopped_camera_shows_nothing_old_when_it_starts_again),
		cmocka_unit_test(watching_the_list_names_departures_and_arrivals),
		cmocka_unit_test(doctor_finds_the_camera_and_what_its_bus_carries),
	};

	if (argc != 4) {
		fprintf(stderr, "usage: %s CAMERA-PROGRAM PICTURES STAGECTL\n", argv[0]);
		return EXIT_FAILURE;
	}
	program = argv[1];
	pictures_dir = argv[2];
	stagectl = argv[3];
	if (pictures_load(&truth, pictures_dir))
		return EXIT_FAILURE;
	cmocka_set_message_output(CM_OUTPUT_TAP);
	int failed = cmocka_run_group_tests(tests, NULL, NULL);

	pictures_finish(&truth);
	return failed;
}
