/*
 * The running station, subscribed to as any solver does.
 */
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/exit_codes.h"
#include "config/layout_file.h"
#include "ctl/calibrate/actor_feed.h"
#include "protocol/stage_client.h"

#define FIRST_WAIT_MS 5000
#define WAIT_MS 100
#define SURE 0.9f

struct live_feed {
	struct actor_feed base;
	struct stage_client *client;
	struct layout station; /* as the station describes it */
};

static void copy_name(char *to, const char *from)
{
	snprintf(to, NAME_BYTES, "%s", from);
}

static int read_description(const struct stage_description *d, struct layout *out)
{
	if (d->actor_count > ACTOR_MAX || d->label_count > LABEL_MAX)
		return -EPROTO;
	memset(out, 0, sizeof(*out));
	out->actor_count = d->actor_count;
	out->marker_count = d->label_count;
	for (uint32_t a = 0; a < d->actor_count; a++)
		copy_name(out->actors[a].name, d->actors[a]);
	for (uint32_t i = 0; i < d->label_count; i++) {
		const struct stage_label *l = &d->labels[i];
		struct layout_marker *m = &out->markers[i];

		if (l->actor >= d->actor_count)
			return -EPROTO;
		copy_name(m->name, l->name);
		copy_name(m->group, l->group);
		copy_name(m->segment, l->segment);
		m->rigid = l->rigid;
		m->diameter_m = l->diameter_m;
		m->neutral_m = (struct vec3){l->neutral_m[0], l->neutral_m[1], l->neutral_m[2]};
		if (out->actors[l->actor].count++ == 0)
			out->actors[l->actor].first = i;
	}
	return 0;
}

static void take_marker(const struct actor_feed *feed, const struct stage_marker *m,
			struct actor_shot *shot)
{
	uint32_t i = (uint32_t)m->label - feed->first;

	if (m->label < (int32_t)feed->first || i >= feed->count)
		return;
	shot->seen[i] =
		m->status == STAGE_MEASURED && m->confidence >= SURE && !isnan(m->stabilised_m[0]);
	shot->p_m[i] = (struct vec3){m->stabilised_m[0], m->stabilised_m[1], m->stabilised_m[2]};
}

static void take_markers(struct actor_feed *feed, const struct stage_marker_set *set,
			 struct actor_shot *shot)
{
	shot->mid_exposure_ns = set->mid_exposure_ns;
	shot->count = feed->count;
	shot->head_found = false;
	memset(shot->seen, 0, sizeof(shot->seen));
	feed->loose = 0;
	for (uint32_t h = 0; h < set->head_count; h++)
		shot->head_found |= set->heads[h].actor == feed->actor;
	for (uint32_t m = 0; m < set->marker_count; m++) {
		feed->loose += set->markers[m].label == STAGE_LABEL_NONE;
		take_marker(feed, &set->markers[m], shot);
	}
}

/* A new rig gives a new description; the actors must be the same. */
static int check_same(struct live_feed *feed, const struct stage_description *description)
{
	static struct layout now; /* this thread's */

	if (read_description(description, &now) < 0)
		return -EPROTO;
	return memcmp(&now, &feed->station, sizeof(now)) == 0 ? 0 : -ESTALE;
}

static int live_next(struct actor_feed *base, struct actor_shot *shot)
{
	struct live_feed *feed = (struct live_feed *)base;
	struct stage_event event;

	for (;;) {
		int err = stage_client_next(feed->client, WAIT_MS, &event);

		if (!err && event.kind == STAGE_DESCRIPTION)
			err = check_same(feed, event.description);
		if (err)
			return err;
		if (event.kind == STAGE_NOTICE)
			fprintf(stderr, "the station says: %s\n", event.notice->text);
		if (event.kind != STAGE_MARKERS)
			continue;
		take_markers(base, event.markers, shot);
		return 0;
	}
}

static void live_close(struct actor_feed *base)
{
	stage_client_close(((struct live_feed *)base)->client);
	free(base);
}

static const struct actor_feed_kind live_kind = {"the station", true, live_next, live_close};

/* What a stream does not tell: feature points. The names must be the same. */
static int add_layout(struct actor_feed *feed, const char *path, struct diag *diag)
{
	static struct layout given; /* this thread's; large */
	int err = layout_load(&given, path, diag);
	bool same = given.marker_count == feed->count;

	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	for (uint32_t i = 0; same && i < feed->count; i++)
		same = strcmp(given.markers[i].name, feed->layout.markers[i].name) == 0;
	if (!same) {
		diag_add(diag,
			 "%s: its markers are not those that the station tracks under the name "
			 "'%s'; put it under `layout` in the station's config and start the "
			 "station again",
			 path, feed->layout.actors[0].name);
		return EXIT_CODE_BAD_INPUT;
	}
	feed->layout = given;
	return EXIT_CODE_OK;
}

static int begin(struct live_feed *feed, const struct actor_source *source, const char *path,
		 struct diag *diag)
{
	struct stage_event event;
	int err = stage_client_open(&feed->client, path);

	if (err) {
		diag_add(diag,
			 "%s: no station streams here: %s; is staged running, with this "
			 "--socket-dir? Without a station, --from takes a recording",
			 path, strerror(-err));
		return EXIT_CODE_CONNECTION;
	}
	do {
		err = stage_client_next(feed->client, FIRST_WAIT_MS, &event);
	} while (!err && event.kind != STAGE_DESCRIPTION);
	if (!err)
		err = read_description(event.description, &feed->station);
	if (err) {
		diag_add(diag, "%s: the station does not say what it tracks: %s", path,
			 strerror(-err));
		return EXIT_CODE_CONNECTION;
	}
	int code = actor_feed_pick(&feed->base, &feed->station, source, "the station", diag);
	if (code == EXIT_CODE_OK && source->layout_path)
		code = add_layout(&feed->base, source->layout_path, diag);
	return code;
}

int actor_feed_open_live(struct actor_feed **out, const struct actor_source *source,
			 struct diag *diag)
{
	struct live_feed *feed = calloc(1, sizeof(*feed));
	char path[PATH_MAX];

	if (!feed)
		return EXIT_CODE_INTERNAL;
	feed->base.kind = &live_kind;
	snprintf(path, sizeof(path), "%s/stream.sock", source->socket_dir);
	int code = begin(feed, source, path, diag);
	if (code == EXIT_CODE_OK)
		*out = &feed->base;
	else
		live_close(&feed->base);
	return code;
}
