/*
 * libstage against a station that does what it likes: the test itself is the station's end of the
 * socket.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <errno.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "protocol/stage_client.h"
#include "tests/unit/sample_stream.h"

struct link {
	char dir[64], path[128];
	int fd; /* the station's end */
	struct stage_client *client;
	struct stage_event event;
	struct layout layout;
};

static int set_up(void **state)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	struct link *l = calloc(1, sizeof(*l));
	int listener = socket(AF_UNIX, SOCK_STREAM, 0);

	strcpy(l->dir, "/tmp/stage_client_XXXXXX");
	assert_non_null(mkdtemp(l->dir));
	snprintf(l->path, sizeof(l->path), "%s/s", l->dir);
	strcpy(address.sun_path, l->path);
	assert_int_equal(bind(listener, (struct sockaddr *)&address, sizeof(address)), 0);
	assert_int_equal(listen(listener, 1), 0);
	assert_int_equal(stage_client_open(&l->client, l->path), 0);
	l->fd = accept(listener, NULL, NULL);
	assert_true(l->fd >= 0);
	close(listener);
	sample_layout(&l->layout);
	*state = l;
	return 0;
}

static int tear_down(void **state)
{
	struct link *l = *state;

	stage_client_close(l->client);
	close(l->fd);
	unlink(l->path);
	rmdir(l->dir);
	free(l);
	return 0;
}

static int next(struct link *l)
{
	return stage_client_next(l->client, 0, &l->event);
}

static uint8_t *description_frame(const struct link *l, size_t *size_bytes)
{
	struct stream_description description = sample_description(&l->layout);
	uint8_t *frame;

	assert_int_equal(encode_description(&description, &frame, size_bytes), 0);
	return frame;
}

static void message_in_single_bytes_is_put_together(void **state)
{
	struct link *l = *state;
	size_t size_bytes;
	uint8_t *frame = description_frame(l, &size_bytes);

	for (size_t i = 0; i < size_bytes; i++) {
		assert_int_equal(next(l), -ETIMEDOUT);
		assert_int_equal(send(l->fd, frame + i, 1, 0), 1);
	}
	free(frame);
	assert_int_equal(next(l), 0);
	assert_int_equal(l->event.kind, STAGE_DESCRIPTION);
	assert_int_equal(next(l), -ETIMEDOUT);
}

static void description_stays_valid_while_marker_sets_come(void **state)
{
	static struct marker_set set;
	struct link *l = *state;
	struct encoder *encoder;
	size_t size_bytes;
	uint8_t *frame = description_frame(l, &size_bytes);

	assert_int_equal(send(l->fd, frame, size_bytes, 0), size_bytes);
	free(frame);
	assert_int_equal(next(l), 0);
	const struct stage_description *description = l->event.description;
	assert_int_equal(encoder_create(&encoder), 0);
	for (uint64_t shot = 1; shot <= 20; shot++) {
		sample_set(&set, shot, 0);
		frame = encode_marker_set(encoder, &set, 1, &size_bytes);
		assert_int_equal(send(l->fd, frame, size_bytes, 0), size_bytes);
		assert_int_equal(next(l), 0);
		assert_int_equal(l->event.markers->shot, shot);
	}
	assert_string_equal(description->labels[73].name, "marker_73");
	assert_string_equal(description->cameras[1].name, "hd1");
	encoder_destroy(encoder);
}

static void length_beyond_the_limit_is_refused_and_stays_refused(void **state)
{
	const uint8_t header[] = {1, 0, 0, 1}; /* 16 MiB and one byte */
	struct link *l = *state;

	assert_int_equal(send(l->fd, header, sizeof(header), 0), sizeof(header));
	assert_int_equal(next(l), -EPROTO);
	assert_int_equal(next(l), -EPROTO);
}

static void garbage_is_refused(void **state)
{
	const uint8_t bytes[] = {4, 0, 0, 0, 0xff, 0xff, 0xff, 0xff};
	struct link *l = *state;

	assert_int_equal(send(l->fd, bytes, sizeof(bytes), 0), sizeof(bytes));
	assert_int_equal(next(l), -EPROTO);
}

static void stream_cut_in_mid_message_has_ended(void **state)
{
	struct link *l = *state;
	size_t size_bytes;
	uint8_t *frame = description_frame(l, &size_bytes);

	assert_int_equal(send(l->fd, frame, size_bytes / 2, 0), size_bytes / 2);
	free(frame);
	shutdown(l->fd, SHUT_RDWR);
	assert_int_equal(next(l), -ENODATA);
}

static void wait_ends_at_its_timeout(void **state)
{
	struct link *l = *state;
	int64_t before_ns = clock_now_ns();

	assert_int_equal(stage_client_next(l->client, 30, &l->event), -ETIMEDOUT);
	assert_true(clock_now_ns() - before_ns >= 30 * NS_PER_MS);
}

static void station_that_is_not_there_is_an_error(void **state)
{
	struct stage_client *client;
	char too_long[200];

	(void)state;
	memset(too_long, 'a', sizeof(too_long) - 1);
	too_long[sizeof(too_long) - 1] = '\0';
	assert_int_equal(stage_client_open(&client, "/nonexistent/stream.sock"), -ENOENT);
	assert_int_equal(stage_client_open(&client, too_long), -ENAMETOOLONG);
}

int main(void)
{
#define LINK_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
	const struct CMUnitTest tests[] = {
		LINK_TEST(message_in_single_bytes_is_put_together),
		LINK_TEST(description_stays_valid_while_marker_sets_come),
		LINK_TEST(length_beyond_the_limit_is_refused_and_stays_refused),
		LINK_TEST(garbage_is_refused),
		LINK_TEST(stream_cut_in_mid_message_has_ended),
		LINK_TEST(wait_ends_at_its_timeout),
		cmocka_unit_test(station_that_is_not_there_is_an_error),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("protocol_client", tests, NULL, NULL);
}
