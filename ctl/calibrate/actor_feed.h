/*
 * Where the markers of an actor come from while he is calibrated: the running station, a recording,
 * or a scene of the simulator as fast as it goes.
 */
#pragma once

#include "base/diag.h"
#include "calib/actor/actor.h"

struct actor_feed {
	const struct actor_feed_kind *kind;
	struct layout layout;  /* of the actor alone */
	uint32_t actor;        /* of the source */
	uint32_t first, count; /* his markers there */
	uint32_t loose;        /* points of the last shot that bear no name */
};

struct actor_feed_kind {
	const char *place; /* "the station": for messages */
	bool live;
	/* 0; -ETIMEDOUT: nothing for a tenth of a second; -EINTR; -ENODATA at the end; or another
	 * negative errno. */
	int (*next)(struct actor_feed *feed, struct actor_shot *shot);
	void (*close)(struct actor_feed *feed); /* frees it */
};

struct actor_source {
	const char *socket_dir; /* the station's; used when the two others are NULL */
	const char *config;     /* of a recording */
	const char *scene;
	uint64_t seed;           /* of the scene */
	const char *layout_path; /* NULL: the source's own */
	const char *actor;       /* of the source */
};

/* Returns an exit code, with messages. */
int actor_feed_open(struct actor_feed **out, const struct actor_source *source, struct diag *diag);
void actor_feed_close(struct actor_feed *feed); /* accepts NULL */

/* For the three kinds: each opens its own. */
int actor_feed_open_live(struct actor_feed **out, const struct actor_source *source,
			 struct diag *diag);
/* Finds the source's actor in `layout` and takes his part of it. Returns an exit code. */
int actor_feed_pick(struct actor_feed *feed, const struct layout *layout,
		    const struct actor_source *source, const char *where, struct diag *diag);
