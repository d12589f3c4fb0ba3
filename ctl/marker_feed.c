/*
 * Not every shot: what lies nearer together than APART_NS says little new.
 */
#include "ctl/marker_feed.h"

#include <errno.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/exit_codes.h"
#include "calib/rig/rig_store.h"
#include "ctl/control_client.h"
#include "ctl/replay.h"

#define APART_NS (NS_PER_S / 70)
#define SHOTS_MAX 600

/* One shot with the cameras of the rig alone. */
struct feed_shot {
	struct blob_set sets[CAMERA_MAX];
	struct marker_set set;
};

/* Bits of the config's cameras to bits of the rig's. */
static uint32_t mask_of_rig(const struct stage *stage, uint32_t mask)
{
	uint32_t of_rig = 0;

	for (uint32_t c = 0; c < stage->config.camera_count; c++)
		if (mask >> c & 1 && stage->view_index[c] != VIEW_NONE)
			of_rig |= UINT32_C(1) << stage->view_index[c];
	return of_rig;
}

static int add(struct marker_feed *feed, const struct shot *shot, struct marker_set *set)
{
	const struct stage *stage = &feed->stage;
	struct shot of_rig = {.camera_count = stage->rig.camera_count};

	for (uint32_t c = 0; c < stage->config.camera_count; c++)
		if (stage->view_index[c] != VIEW_NONE)
			of_rig.sets[stage->view_index[c]] = shot->sets[c];
	for (uint32_t m = 0; m < set->marker_count; m++)
		set->markers[m].camera_mask = mask_of_rig(stage, set->markers[m].camera_mask);
	return marker_shots_add(&feed->shots, &of_rig, set);
}

static bool is_dir(const char *path)
{
	struct stat st;

	return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

static int read_shots(struct marker_feed *feed, struct replay *replay, struct marker_set *own)
{
	const struct marker_set *set;
	int64_t next_ns = INT64_MIN;
	int err = 0;

	while (!err && feed->shots.shot_count < SHOTS_MAX && (set = replay_next(replay))) {
		if (set->mid_exposure_ns < next_ns)
			continue;
		next_ns = set->mid_exposure_ns + APART_NS;
		*own = *set;
		err = add(feed, replay_shot(replay), own);
	}
	return err;
}

static void config_path(char path[PATH_MAX], const char *from)
{
	snprintf(path, PATH_MAX, is_dir(from) ? "%.*s/stage.yaml" : "%.*s", PATH_MAX - 16, from);
}

static int check_place(const struct marker_feed *feed, const struct marker_feed_source *source,
		       struct diag *diag)
{
	return source->for_new_rig ? rig_store_check(feed->stage.config.rig_dir, diag) : 0;
}

static int open_recording(struct marker_feed *feed, const struct marker_feed_source *source,
			  struct diag *diag)
{
	struct replay *replay = NULL;
	struct marker_set *own = malloc(sizeof(*own));
	char path[PATH_MAX];
	int err = own ? 0 : -ENOMEM;

	config_path(path, source->from);
	int code = err ? EXIT_CODE_INTERNAL
		       : replay_open(&replay, path, NULL, (uint64_t)sysconf(_SC_NPROCESSORS_ONLN),
				     diag);
	if (code == EXIT_CODE_OK) {
		err = stage_load(&feed->stage, path, diag);
		if (!err)
			err = check_place(feed, source, diag);
		if (!err)
			err = read_shots(feed, replay, own);
		code = exit_code_of(err, EXIT_CODE_BAD_INPUT);
	}
	replay_close(replay);
	free(own);
	return code;
}

static double number_at(const json_t *array, size_t index)
{
	return json_number_value(json_array_get(array, index));
}

static void take_spots(struct blob_set *set, const json_t *spots)
{
	size_t index;
	json_t *spot;

	set->blob_count = 0;
	json_array_foreach((json_t *)spots, index, spot)
	{
		if (set->blob_count == BLOB_MAX)
			break;
		set->blobs[set->blob_count++] =
			(struct blob){.x_px = (float)number_at(spot, 0),
				      .y_px = (float)number_at(spot, 1),
				      .sigma_px = (float)number_at(spot, 2),
				      .flags = (uint16_t)number_at(spot, 3)};
	}
}

static void take_markers(struct marker_set *set, const json_t *markers)
{
	size_t index;
	json_t *marker;

	set->marker_count = 0;
	json_array_foreach((json_t *)markers, index, marker)
	{
		if (set->marker_count == MARKER_MAX)
			break;
		set->markers[set->marker_count++] =
			(struct marker){.label = (int16_t)number_at(marker, 0),
					.status = (uint8_t)number_at(marker, 1),
					.camera_mask = (uint32_t)number_at(marker, 2),
					.p_stage_m = {number_at(marker, 3), number_at(marker, 4),
						      number_at(marker, 5)}};
	}
}

/* What the station says of a shot. */
static int take_reply(struct marker_feed *feed, struct feed_shot *shot, const json_t *reply)
{
	const json_t *cameras = json_object_get(reply, "cameras");
	struct shot seen = {.camera_count = feed->stage.config.camera_count};

	for (uint32_t c = 0; c < seen.camera_count; c++) {
		const json_t *spots = json_array_get(cameras, c);

		if (!json_is_array(spots))
			continue;
		take_spots(&shot->sets[c], spots);
		seen.sets[c] = &shot->sets[c];
	}
	take_markers(&shot->set, json_object_get(reply, "markers"));
	return add(feed, &seen, &shot->set);
}

static void show_progress(const struct marker_feed *feed, double share)
{
	if (isatty(STDERR_FILENO))
		fprintf(stderr, "\r%3.0f %%, %u shots ", 100 * share, feed->shots.shot_count);
}

static int watch(struct marker_feed *feed, const struct marker_feed_source *source)
{
	struct feed_shot *shot = calloc(1, sizeof(*shot));
	int64_t begin_ns = clock_real_now_ns(), last_ns = 0, first_ns = 0;
	double wanted_ns = source->seconds * NS_PER_S;
	int code = shot ? EXIT_CODE_OK : EXIT_CODE_INTERNAL;

	/* seconds of the station, whose time may be virtual; three times as long by our own */
	while (code == EXIT_CODE_OK && feed->shots.shot_count < SHOTS_MAX &&
	       (double)(last_ns - first_ns) < wanted_ns &&
	       (double)(clock_real_now_ns() - begin_ns) < 3 * wanted_ns) {
		json_t *reply;

		code = control_ask(&reply, source->socket_dir, "org.stage.Control.Observe", NULL);
		if (code)
			break;
		int64_t time_ns = json_integer_value(json_object_get(reply, "mid_exposure_ns"));
		if (time_ns - last_ns >= APART_NS && take_reply(feed, shot, reply))
			code = EXIT_CODE_INTERNAL;
		if (time_ns - last_ns >= APART_NS)
			last_ns = time_ns;
		if (!first_ns)
			first_ns = time_ns;
		json_decref(reply);
		show_progress(feed, (double)(last_ns - first_ns) / wanted_ns);
	}
	if (isatty(STDERR_FILENO))
		fputc('\n', stderr);
	free(shot);
	return code;
}

/* The station's own files, which must be what it uses. */
static int load_station(struct marker_feed *feed, const struct marker_feed_source *source,
			struct diag *diag)
{
	json_t *reply;
	int code = control_ask(&reply, source->socket_dir, "org.stage.Control.GetStatus", NULL);

	if (code)
		return code;
	const json_t *status = json_object_get(reply, "status");
	const char *config = json_string_value(json_object_get(status, "config"));
	const char *revision = json_string_value(json_object_get(status, "rig_revision"));
	int err = stage_load(&feed->stage, config ? config : "", diag);
	if (!err && strcmp(revision ? revision : "", feed->stage.rig.revision)) {
		diag_add(diag,
			 "%s: the station uses another rig (%s) than is there (%s); stagectl rig "
			 "reload first",
			 feed->stage.config.rig_dir, revision ? revision : "?",
			 feed->stage.rig.revision);
		err = -EINVAL;
	}
	if (!err)
		err = check_place(feed, source, diag);
	json_decref(reply);
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

int marker_feed_open(struct marker_feed **out, const struct marker_feed_source *source,
		     struct diag *diag)
{
	struct marker_feed *feed = calloc(1, sizeof(*feed));
	int code = EXIT_CODE_INTERNAL;

	if (feed && source->from)
		code = open_recording(feed, source, diag);
	else if (feed)
		code = load_station(feed, source, diag);
	if (code == EXIT_CODE_OK && !source->from)
		code = watch(feed, source);
	if (code == EXIT_CODE_OK)
		*out = feed;
	else
		marker_feed_close(feed);
	return code;
}

/* Of the IR cameras, as the station loads it. */
static int load_rig(struct stage *stage, struct diag *diag)
{
	char names[CAMERA_MAX][NAME_BYTES];
	uint32_t count = 0;

	for (uint32_t c = 0; c < stage->config.camera_count; c++)
		if (stage->config.cameras[c].role == ROLE_IR)
			memcpy(names[count++], stage->config.cameras[c].name, NAME_BYTES);
	return rig_load(&stage->rig, stage->config.rig_dir, (const char(*)[NAME_BYTES])names, count,
			diag);
}

int marker_feed_open_rig(struct marker_feed **out, const char *from, struct diag *diag)
{
	struct marker_feed *feed = calloc(1, sizeof(*feed));
	char path[PATH_MAX];

	config_path(path, from);
	int err = feed ? config_load(&feed->stage.config, path, diag) : -ENOMEM;
	if (!err)
		err = rig_store_check(feed->stage.config.rig_dir, diag);
	if (!err)
		err = load_rig(&feed->stage, diag);
	if (err)
		free(feed);
	else
		*out = feed;
	return exit_code_of(err, EXIT_CODE_BAD_INPUT);
}

void marker_feed_close(struct marker_feed *feed)
{
	if (!feed)
		return;
	marker_shots_finish(&feed->shots);
	stage_finish(&feed->stage);
	free(feed);
}
