/*
 * A station for the tests of other languages' clients: serve_sample SOCKET prints "ready", sends
 * the sample sets 1 .. 50 to the first subscriber and ends.
 */
#include <stdlib.h>

#include "daemon/server.h"
#include "tests/unit/sample_stream.h"

#define SETS 50

static uint32_t subscriber_count(const struct server *server)
{
	struct server_stats stats;

	server_stats(server, &stats);
	return stats.subscriber_count;
}

/* Of the only subscriber. */
static uint32_t queued_bytes(const struct server *server)
{
	struct server_stats stats;

	server_stats(server, &stats);
	return stats.subscriber_count ? stats.subscribers[0].queued_bytes : 0;
}

int main(int argc, char **argv)
{
	static struct layout layout;
	static struct marker_set set;
	struct server *server;
	sd_event *event;

	if (argc != 2 || sd_event_new(&event) < 0)
		return 1;
	sample_layout(&layout);
	struct stream_description description = sample_description(&layout);
	if (server_create(&server, event, argv[1], &description, NULL) < 0)
		return 1;
	puts("ready");
	fflush(stdout);
	while (subscriber_count(server) == 0)
		if (sd_event_run(event, 10 * 1000 * 1000) <= 0)
			return 1; /* nobody came in ten seconds */
	for (uint64_t shot = 1; shot <= SETS; shot++) {
		sample_set(&set, shot, 3);
		server_publish(server, &set);
	}
	while (queued_bytes(server) > 0)
		if (sd_event_run(event, 10 * 1000 * 1000) <= 0)
			return 1;
	server_destroy(server);
	sd_event_unref(event);
	return 0;
}
