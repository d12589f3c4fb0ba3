/*
 * A smallest subscriber: prints one line per second.
 *     cc subscribe.c $(pkg-config --cflags --libs stage) && ./a.out /run/stage/stream.sock
 */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "stage_client.h"

static unsigned count_named(const struct stage_marker_set *set)
{
	unsigned count = 0;

	for (uint32_t i = 0; i < set->marker_count; i++)
		if (set->markers[i].label != STAGE_LABEL_NONE &&
		    set->markers[i].status >= STAGE_TWO_CAMERA)
			count++;
	return count;
}

static void print_set(const struct stage_marker_set *set)
{
	static int64_t second = -1;

	if (set->mid_exposure_ns / 1000000000 == second)
		return;
	second = set->mid_exposure_ns / 1000000000;
	printf("shot %" PRIu64 ": %u named markers seen, %" PRIu64 " sets lost\n", set->shot,
	       count_named(set), set->sets_lost);
	fflush(stdout);
}

static void print_event(const struct stage_event *event)
{
	switch (event->kind) {
	case STAGE_DESCRIPTION:
		printf("%u cameras, %u labels, rig %s\n", event->description->camera_count,
		       event->description->label_count, event->description->rig_revision);
		break;
	case STAGE_MARKERS:
		print_set(event->markers);
		break;
	case STAGE_NOTICE:
		printf("the station says: %s\n", event->notice->text);
		break;
	case STAGE_STATISTICS:
		if (event->statistics->unnamed)
			printf("no names for %.0f s: %s\n", event->statistics->unnamed->seconds,
			       event->statistics->unnamed->remedy);
		break;
	case STAGE_UNKNOWN:
		break;
	}
}

int main(int argc, char **argv)
{
	const char *path = argc > 1 ? argv[1] : "/run/stage/stream.sock";
	struct stage_client *client;
	struct stage_event event;
	int r = stage_client_open(&client, path);

	if (r < 0) {
		fprintf(stderr, "%s: %s: is the station running?\n", path, strerror(-r));
		return 1;
	}
	while ((r = stage_client_next(client, -1, &event)) == 0)
		print_event(&event);
	fprintf(stderr, "%s: the stream ended: %s\n", path, strerror(-r));
	stage_client_close(client);
	return r == -ENODATA ? 0 : 1; /* the station's own end; or a broken stream */
}
