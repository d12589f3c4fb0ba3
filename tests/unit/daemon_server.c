/*
 * The stream server with real subscribers on a real socket. Everything runs in one thread: the
 * event loop is stepped by hand, so that nothing depends on timing.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <errno.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "daemon/server.h"
#include "protocol/stage_client.h"
#include "tests/unit/sample_stream.h"

struct station {
	char dir[64], path[128];
	sd_event *event;
	struct layout layout;
	struct stream_description description;
	struct server *server;
	struct marker_set set;
	struct diag diag;
};

static int set_up(void **state)
{
	struct station *s = calloc(1, sizeof(*s));

	strcpy(s->dir, "/tmp/stage_server_XXXXXX");
	assert_non_null(mkdtemp(s->dir));
	snprintf(s->path, sizeof(s->path), "%s/stream.sock", s->dir);
	assert_true(sd_event_new(&s->event) >= 0);
	sample_layout(&s->layout);
	s->description = sample_description(&s->layout);
	assert_int_equal(server_create(&s->server, s->event, s->path, &s->description, &s->diag),
			 0);
	*state = s;
	return 0;
}

static int tear_down(void **state)
{
	struct station *s = *state;

	server_destroy(s->server);
	sd_event_unref(s->event);
	unlink(s->path);
	assert_int_equal(rmdir(s->dir), 0);
	diag_finish(&s->diag);
	free(s);
	return 0;
}

/* Lets the server do all that waits to be done. */
static void step(struct station *s)
{
	while (sd_event_run(s->event, 0) > 0)
		;
}

static void publish(struct station *s, uint64_t shot)
{
	sample_set(&s->set, shot, 0);
	server_publish(s->server, &s->set);
	step(s);
}

static struct stage_client *subscribe(struct station *s)
{
	struct stage_client *client;

	assert_int_equal(stage_client_open(&client, s->path), 0);
	step(s);
	return client;
}

/* A subscriber that has read its description. */
static struct stage_client *subscribe_and_read(struct station *s)
{
	struct stage_client *client = subscribe(s);
	struct stage_event event;

	assert_int_equal(stage_client_next(client, 0, &event), 0);
	assert_int_equal(event.kind, STAGE_DESCRIPTION);
	return client;
}

static void assert_gets_shot(struct stage_client *client, uint64_t shot)
{
	struct stage_event event;

	assert_int_equal(stage_client_next(client, 0, &event), 0);
	assert_int_equal(event.kind, STAGE_MARKERS);
	assert_int_equal(event.markers->shot, shot);
}

static struct server_stats stats(const struct station *s)
{
	struct server_stats out;

	server_stats(s->server, &out);
	return out;
}

static void description_comes_first(void **state)
{
	struct station *s = *state;
	struct stage_event event;

	publish(s, 1);
	struct stage_client *client = subscribe(s);
	publish(s, 2);
	assert_int_equal(stage_client_next(client, 0, &event), 0);
	assert_int_equal(event.kind, STAGE_DESCRIPTION);
	assert_string_equal(event.description->labels[73].name, "marker_73");
	assert_gets_shot(client, 2);
	assert_int_equal(stage_client_next(client, 0, &event), -ETIMEDOUT);
	stage_client_close(client);
}

static void changed_description_comes_before_the_next_set(void **state)
{
	struct station *s = *state;
	struct stage_client *early = subscribe_and_read(s);
	struct stage_event event;

	publish(s, 1);
	s->description.rig_revision = "0ther0ther0ther0";
	s->description.rig_serial = 2;
	server_redescribe(s->server);
	struct stage_client *late = subscribe_and_read(s); /* has the new one already */
	publish(s, 2);
	publish(s, 3);
	assert_gets_shot(early, 1);
	assert_int_equal(stage_client_next(early, 0, &event), 0);
	assert_int_equal(event.kind, STAGE_DESCRIPTION);
	assert_string_equal(event.description->rig_revision, "0ther0ther0ther0");
	assert_int_equal(event.description->rig_serial, 2);
	for (uint64_t shot = 2; shot <= 3; shot++) {
		assert_gets_shot(early, shot);
		assert_gets_shot(late, shot);
	}
	stage_client_close(early);
	stage_client_close(late);
}

/* Else it would take a set for one of the rig before. */
static void subscriber_without_room_for_the_description_gets_no_set_before_it(void **state)
{
	struct station *s = *state;
	struct stage_client *client = subscribe_and_read(s);
	struct stage_event event;
	bool described = false;
	uint64_t new_sets = 0;

	while (stats(s).sets_lost == 0)
		publish(s, 1);
	s->description.rig_serial = 2;
	server_redescribe(s->server);
	for (int round = 0; round < 10; round++) {
		sample_set(&s->set, 2, 0);
		s->set.rig_serial = 2;
		server_publish(s->server, &s->set); /* lost, as long as there is no room */
		for (step(s); stage_client_next(client, 0, &event) == 0; step(s)) {
			described |= event.kind == STAGE_DESCRIPTION;
			if (event.kind != STAGE_MARKERS)
				continue;
			assert_int_equal(event.markers->rig_serial == 2, described);
			new_sets += described;
		}
	}
	assert_true(described);
	assert_int_equal(new_sets, 9); /* all but the first, for which there was no room */
	stage_client_close(client);
}

static void everything_goes_to_every_subscriber(void **state)
{
	struct station *s = *state;
	struct stage_client *a = subscribe_and_read(s), *b = subscribe_and_read(s);

	for (uint64_t shot = 1; shot <= 200; shot++) {
		publish(s, shot);
		assert_gets_shot(a, shot);
		assert_gets_shot(b, shot);
	}
	assert_int_equal(stats(s).sets_lost, 0);
	stage_client_close(a);
	stage_client_close(b);
}

/* Reads all that waits: shots must rise and come whole. Returns how many. */
static uint64_t drain(struct station *s, struct stage_client *client, uint64_t *sets_lost)
{
	uint64_t received = 0, last_shot = 0;
	struct stage_event event;

	while (step(s), stage_client_next(client, 0, &event) == 0) {
		assert_int_equal(event.kind, STAGE_MARKERS);
		assert_true(event.markers->shot > last_shot);
		assert_int_equal(event.markers->marker_count, SAMPLE_LABELS);
		last_shot = event.markers->shot;
		*sets_lost = event.markers->sets_lost;
		received++;
	}
	return received;
}

static void slow_subscriber_loses_whole_sets_only(void **state)
{
	const uint64_t sent = 1000;
	struct station *s = *state;
	struct stage_client *fast = subscribe_and_read(s), *slow = subscribe_and_read(s);
	uint64_t sets_lost = 0;

	for (uint64_t shot = 1; shot <= sent; shot++) {
		publish(s, shot);
		assert_gets_shot(fast, shot);
	}
	uint64_t counted = stats(s).sets_lost;
	assert_true(counted > 100);
	assert_int_equal(drain(s, slow, &sets_lost), sent - counted);
	assert_int_equal(sets_lost, 0); /* all it had were queued before the first loss */
	publish(s, sent + 1);
	assert_int_equal(drain(s, slow, &sets_lost), 1);
	assert_int_equal(sets_lost, counted);
	assert_int_equal(stats(s).subscribers[0].sets_lost, 0);
	assert_int_equal(stats(s).subscribers[1].sets_lost, counted);
	stage_client_close(fast);
	stage_client_close(slow);
}

/* Reading a little now and then makes the queue wrap around and sockets take parts of sets. */
static void stuttering_subscriber_gets_whole_sets_and_a_true_loss_count(void **state)
{
	struct station *s = *state;
	struct stage_client *client = subscribe_and_read(s);
	struct stage_event event;
	uint64_t received = 0, sets_lost = 0, last_shot = 0;

	for (uint64_t shot = 1; shot <= 3000; shot++) {
		publish(s, shot);
		if (shot % 3 || stage_client_next(client, 0, &event) < 0)
			continue;
		assert_true(event.markers->shot > last_shot);
		last_shot = event.markers->shot;
		received++;
	}
	received += drain(s, client, &sets_lost);
	assert_true(stats(s).sets_lost > 100);
	assert_int_equal(received + stats(s).sets_lost, 3000);
	stage_client_close(client);
}

static void garbage_from_a_client_cuts_it_off_only(void **state)
{
	struct station *s = *state;
	struct stage_client *good = subscribe_and_read(s), *bad = subscribe_and_read(s);
	struct stage_event event;

	assert_int_equal(send(stage_client_fd(bad), "GET / HTTP/1.1\r\n", 16, 0), 16);
	step(s);
	assert_int_equal(stage_client_next(bad, 0, &event), 0);
	assert_int_equal(event.kind, STAGE_NOTICE);
	assert_true(stage_client_next(bad, 0, &event) < 0);
	publish(s, 1);
	assert_gets_shot(good, 1);
	assert_int_equal(stats(s).cut_off_count, 1);
	assert_int_equal(stats(s).subscriber_count, 1);
	stage_client_close(good);
	stage_client_close(bad);
}

static int raw_connect(const struct station *s)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	int fd = socket(AF_UNIX, SOCK_STREAM, 0);

	strcpy(address.sun_path, s->path);
	assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof(address)), 0);
	return fd;
}

static void client_that_dies_in_mid_message_is_forgotten(void **state)
{
	struct station *s = *state;
	struct stage_client *good = subscribe_and_read(s);
	char part[10];
	int fd = raw_connect(s);

	step(s);
	publish(s, 1);
	assert_int_equal(recv(fd, part, sizeof(part), 0), sizeof(part));
	assert_int_equal(stats(s).subscriber_count, 2);
	close(fd);
	publish(s, 2);
	publish(s, 3);
	assert_int_equal(stats(s).subscriber_count, 1);
	assert_gets_shot(good, 1);
	assert_gets_shot(good, 2);
	assert_gets_shot(good, 3);
	stage_client_close(good);
}

static void subscriber_beyond_the_limit_is_refused_with_a_notice(void **state)
{
	struct station *s = *state;
	struct stage_client *clients[SUBSCRIBER_MAX], *extra;
	struct stage_event event;

	for (int i = 0; i < SUBSCRIBER_MAX; i++)
		clients[i] = subscribe_and_read(s);
	extra = subscribe(s);
	assert_int_equal(stage_client_next(extra, 0, &event), 0);
	assert_int_equal(event.kind, STAGE_NOTICE);
	assert_int_equal(event.notice->kind, NOTICE_REFUSED);
	assert_int_equal(stage_client_next(extra, 0, &event), -ENODATA);
	assert_int_equal(stats(s).refused_count, 1);
	stage_client_close(extra);
	stage_client_close(clients[5]);
	step(s);
	clients[5] = subscribe_and_read(s); /* the place that became free */
	publish(s, 1);
	for (int i = 0; i < SUBSCRIBER_MAX; i++) {
		assert_gets_shot(clients[i], 1);
		stage_client_close(clients[i]);
	}
}

static void end_of_the_station_ends_the_stream(void **state)
{
	struct station *s = *state;
	struct stage_client *client = subscribe_and_read(s);
	struct stage_event event;

	publish(s, 1);
	server_destroy(s->server);
	s->server = NULL;
	assert_gets_shot(client, 1);
	assert_int_equal(stage_client_next(client, 0, &event), -ENODATA);
	assert_int_equal(access(s->path, F_OK), -1);
	stage_client_close(client);
}

static void socket_is_for_owner_and_group_whatever_the_umask(void **state)
{
	struct station *s = *state;
	struct stat st;

	server_destroy(s->server);
	mode_t old = umask(077);
	assert_int_equal(server_create(&s->server, s->event, s->path, &s->description, &s->diag),
			 0);
	umask(old);
	assert_int_equal(stat(s->path, &st), 0);
	assert_int_equal(st.st_mode & 07777, 0660);
}

static void socket_of_a_dead_station_is_replaced(void **state)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	struct station *s = *state;
	int fd = socket(AF_UNIX, SOCK_STREAM, 0);

	server_destroy(s->server);
	strcpy(address.sun_path, s->path);
	assert_int_equal(bind(fd, (struct sockaddr *)&address, sizeof(address)), 0);
	close(fd); /* the path stays behind */
	assert_int_equal(server_create(&s->server, s->event, s->path, &s->description, &s->diag),
			 0);
	stage_client_close(subscribe_and_read(s));
}

static void socket_of_a_live_station_is_left_alone(void **state)
{
	struct station *s = *state;
	struct server *second = NULL;

	assert_int_equal(server_create(&second, s->event, s->path, &s->description, &s->diag),
			 -EADDRINUSE);
	assert_null(second);
	assert_non_null(strstr(s->diag.text, s->path));
	stage_client_close(subscribe_and_read(s));
}

static void file_in_place_of_the_socket_is_left_alone(void **state)
{
	struct station *s = *state;

	server_destroy(s->server);
	s->server = NULL;
	fclose(fopen(s->path, "w"));
	assert_int_equal(server_create(&s->server, s->event, s->path, &s->description, &s->diag),
			 -EEXIST);
	assert_int_equal(access(s->path, F_OK), 0);
}

int main(void)
{
#define SERVER_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
	const struct CMUnitTest tests[] = {
		SERVER_TEST(description_comes_first),
		SERVER_TEST(changed_description_comes_before_the_next_set),
		SERVER_TEST(subscriber_without_room_for_the_description_gets_no_set_before_it),
		SERVER_TEST(everything_goes_to_every_subscriber),
		SERVER_TEST(slow_subscriber_loses_whole_sets_only),
		SERVER_TEST(stuttering_subscriber_gets_whole_sets_and_a_true_loss_count),
		SERVER_TEST(garbage_from_a_client_cuts_it_off_only),
		SERVER_TEST(client_that_dies_in_mid_message_is_forgotten),
		SERVER_TEST(subscriber_beyond_the_limit_is_refused_with_a_notice),
		SERVER_TEST(end_of_the_station_ends_the_stream),
		SERVER_TEST(socket_is_for_owner_and_group_whatever_the_umask),
		SERVER_TEST(socket_of_a_dead_station_is_replaced),
		SERVER_TEST(socket_of_a_live_station_is_left_alone),
		SERVER_TEST(file_in_place_of_the_socket_is_left_alone),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("daemon_server", tests, NULL, NULL);
}
