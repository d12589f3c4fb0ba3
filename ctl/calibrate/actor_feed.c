/*
 * The two offline kinds, and which actor is meant.
 */
#include "ctl/calibrate/actor_feed.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "config/layout_file.h"
#include "ctl/replay.h"
#include "ctl/take_ends.h"
#include "sim/play.h"

#define SCENE_MAX_S 900 /* the script four times over */

static int take_set(struct actor_feed *feed, const struct marker_set *set, struct actor_shot *shot)
{
	actor_shot_of_set(set, feed->actor, feed->first, feed->count, shot);
	feed->loose = set->marker_count - set->label_count;
	return 0;
}

static void list_actors(const struct layout *layout, char *text, size_t size)
{
	text[0] = 0;
	for (uint32_t a = 0; a < layout->actor_count; a++)
		snprintf(text + strlen(text), size - strlen(text), "%s%s", a ? ", " : "",
			 layout->actors[a].name[0] ? layout->actors[a].name : "one without a name");
}

static int check_rigid(const struct layout *layout, const char *where, struct diag *diag)
{
	uint32_t rigid = 0;

	for (uint32_t i = 0; i < layout->marker_count; i++)
		rigid += layout->markers[i].rigid;
	if (rigid >= 3)
		return EXIT_CODE_OK;
	diag_add(diag,
		 "%s: %u of the actor's markers are rigid, but without three that move with the "
		 "skull alone the head's motion cannot be told from the face's; put a head band "
		 "on, and say `rigid: true` of its markers",
		 where, rigid);
	return EXIT_CODE_BAD_INPUT;
}

int actor_feed_pick(struct actor_feed *feed, const struct layout *layout,
		    const struct actor_source *source, const char *where, struct diag *diag)
{
	char names[ACTOR_MAX * (NAME_BYTES + 2)];

	for (uint32_t a = 0; a < layout->actor_count; a++) {
		const char *name = layout->actors[a].name;

		if (strcmp(name, source->actor) != 0 && (name[0] || layout->actor_count > 1))
			continue;
		feed->actor = a;
		feed->first = layout->actors[a].first;
		feed->count = layout->actors[a].count;
		actor_layout(layout, a, &feed->layout);
		return check_rigid(&feed->layout, where, diag);
	}
	list_actors(layout, names, sizeof(names));
	diag_add(diag,
		 "%s: has no actor '%s', but %s; if one of those layouts is of the markers worn, "
		 "name it with --actor, else put the right layout into the config",
		 where, source->actor, names);
	return EXIT_CODE_BAD_INPUT;
}

struct replay_feed {
	struct actor_feed base;
	struct replay *replay;
};

static int replay_feed_next(struct actor_feed *base, struct actor_shot *shot)
{
	const struct marker_set *set = replay_next(((struct replay_feed *)base)->replay);

	return set ? take_set(base, set, shot) : -ENODATA;
}

static void replay_feed_close(struct actor_feed *base)
{
	replay_close(((struct replay_feed *)base)->replay);
	free(base);
}

static const struct actor_feed_kind replay_kind = {"the recording", false, replay_feed_next,
						   replay_feed_close};

static int open_replay(struct actor_feed **out, const struct actor_source *source,
		       struct diag *diag)
{
	struct replay_feed *feed = calloc(1, sizeof(*feed));
	int code = feed ? replay_open(&feed->replay, source->config, source->layout_path, 2, diag)
			: EXIT_CODE_INTERNAL;

	if (code == EXIT_CODE_OK)
		code = actor_feed_pick(&feed->base, &replay_stage(feed->replay)->layout, source,
				       source->config, diag);
	if (feed)
		feed->base.kind = &replay_kind;
	if (code == EXIT_CODE_OK)
		*out = &feed->base;
	else
		actor_feed_close(feed ? &feed->base : NULL);
	return code;
}

struct scene_feed {
	struct actor_feed base;
	struct layout given;
	struct sim_play play;
	uint64_t shot;
};

static int scene_feed_next(struct actor_feed *base, struct actor_shot *shot)
{
	static const struct blob_play as_optics = {0};
	struct scene_feed *feed = (struct scene_feed *)base;
	int64_t time_ns = sim_scene_mid_exposure_ns(feed->play.scene, feed->shot);

	if (time_ns > SCENE_MAX_S * NS_PER_S)
		return -ENODATA;
	sim_play_shot_us(&feed->play, &as_optics, feed->shot++, 0);
	return take_set(base, &feed->play.set, shot);
}

static void scene_feed_close(struct actor_feed *base)
{
	sim_play_finish(&((struct scene_feed *)base)->play);
	free(base);
}

static const struct actor_feed_kind scene_kind = {"the scene", false, scene_feed_next,
						  scene_feed_close};

/* The tracker knows the markers as the file has them, whatever the scene wears. */
static int use_layout(struct scene_feed *feed, const char *path, struct diag *diag)
{
	int err = layout_load(&feed->given, path, diag);

	if (err)
		return exit_code_of(err, EXIT_CODE_BAD_INPUT);
	feed->play.tracker_rig.layout = &feed->given;
	tracker_state_init(&feed->play.state, &feed->given);
	return EXIT_CODE_OK;
}

static int open_scene(struct actor_feed **out, const struct actor_source *source, struct diag *diag)
{
	struct sim_options options = {.scene = source->scene, .seed = source->seed};
	struct scene_feed *feed = calloc(1, sizeof(*feed));

	if (!feed)
		return EXIT_CODE_INTERNAL;
	feed->base.kind = &scene_kind;
	int code = exit_code_of(sim_play_init(&feed->play, &options, diag), EXIT_CODE_BAD_INPUT);
	if (code == EXIT_CODE_OK && source->layout_path)
		code = use_layout(feed, source->layout_path, diag);
	if (code == EXIT_CODE_OK)
		code = actor_feed_pick(&feed->base, feed->play.tracker_rig.layout, source,
				       source->layout_path ? source->layout_path : source->scene,
				       diag);
	if (code == EXIT_CODE_OK)
		*out = &feed->base;
	else
		actor_feed_close(&feed->base);
	return code;
}

int actor_feed_open(struct actor_feed **out, const struct actor_source *source, struct diag *diag)
{
	if (source->config)
		return open_replay(out, source, diag);
	if (source->scene)
		return open_scene(out, source, diag);
	return actor_feed_open_live(out, source, diag);
}

void actor_feed_close(struct actor_feed *feed)
{
	if (feed)
		feed->kind->close(feed);
}
