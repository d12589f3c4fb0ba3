/*
 * Packs with protobuf-c. The message structs of a marker set are made once and chained to their
 * parents, so that encoding fills in numbers and allocates nothing.
 */
#include "protocol/encode.h"

#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "protocol/encode_parts.h"

/* The largest packed sizes that the fields of stage.proto can take, with room to spare. */
#define MARKER_BYTES_MAX 160
#define HEAD_BYTES_MAX 112
#define SET_BYTES_MAX (256 + HEAD_MAX * HEAD_BYTES_MAX + MARKER_MAX * MARKER_BYTES_MAX)

#define TAG_SETS_LOST ((15 << 3) | 0) /* Message.sets_lost, a varint */

struct encoder {
	Stage__V1__Message message;
	Stage__V1__MarkerSet set;
	Stage__V1__HdShot hd;
	Stage__V1__Head heads[HEAD_MAX], *head_pointers[HEAD_MAX];
	Stage__V1__Marker markers[MARKER_MAX], *marker_pointers[MARKER_MAX];
	double q_wxyz[HEAD_MAX][4], t_m[HEAD_MAX][3];
	float cov_m2[MARKER_MAX][6], stabilised_m[MARKER_MAX][3], normalised_m[MARKER_MAX][3];
	uint8_t frame[FRAME_HEADER_BYTES + SET_BYTES_MAX + FRAME_TAIL_BYTES];
};

static void write_header(uint8_t *frame, size_t size_bytes)
{
	size_t body = size_bytes - FRAME_HEADER_BYTES;

	for (int i = 0; i < FRAME_HEADER_BYTES; i++)
		frame[i] = (uint8_t)(body >> (8 * i));
}

int encoder_create(struct encoder **out)
{
	struct encoder *e = calloc(1, sizeof(*e));

	if (!e)
		return -ENOMEM;
	stage__v1__message__init(&e->message);
	stage__v1__marker_set__init(&e->set);
	stage__v1__hd_shot__init(&e->hd);
	e->message.body_case = STAGE__V1__MESSAGE__BODY_MARKERS;
	e->message.markers = &e->set;
	e->set.heads = e->head_pointers;
	e->set.markers = e->marker_pointers;
	for (int i = 0; i < HEAD_MAX; i++) {
		stage__v1__head__init(&e->heads[i]);
		e->head_pointers[i] = &e->heads[i];
		e->heads[i].n_q_wxyz = 4;
		e->heads[i].q_wxyz = e->q_wxyz[i];
		e->heads[i].n_t_m = 3;
		e->heads[i].t_m = e->t_m[i];
	}
	for (int i = 0; i < MARKER_MAX; i++) {
		stage__v1__marker__init(&e->markers[i]);
		e->marker_pointers[i] = &e->markers[i];
		e->markers[i].cov_m2 = e->cov_m2[i];
		e->markers[i].stabilised_m = e->stabilised_m[i];
		e->markers[i].normalised_m = e->normalised_m[i];
	}
	*out = e;
	return 0;
}

void encoder_destroy(struct encoder *encoder)
{
	free(encoder);
}

static void fill_head(struct encoder *e, uint32_t slot, uint32_t actor, const struct head *head)
{
	Stage__V1__Head *to = &e->heads[slot];

	pose_to_quaternion(&head->rt_stage_head, e->q_wxyz[slot]);
	e->t_m[slot][0] = head->rt_stage_head.t.x;
	e->t_m[slot][1] = head->rt_stage_head.t.y;
	e->t_m[slot][2] = head->rt_stage_head.t.z;
	to->actor = actor;
	to->residual_m = head->residual_m;
	to->rigid_count = head->rigid_count;
	to->jig_slip = head->jig_slip;
	to->slip_m = head->slip_m;
}

/* A missing marker keeps its label and status; zero fields take no room on the wire. */
static void fill_marker(struct encoder *e, uint32_t slot, const struct marker *from)
{
	Stage__V1__Marker *to = &e->markers[slot];
	bool known = from->status != MARKER_MISSING;

	to->label = from->label;
	to->status = (Stage__V1__Marker__Status)from->status;
	to->x_m = known ? from->p_stage_m.x : 0;
	to->y_m = known ? from->p_stage_m.y : 0;
	to->z_m = known ? from->p_stage_m.z : 0;
	to->n_cov_m2 = known ? 6 : 0;
	for (int i = 0; i < 6; i++)
		e->cov_m2[slot][i] = (float)from->cov_m2[i];
	to->residual_px = known ? from->residual_px : 0;
	to->camera_mask = known ? from->camera_mask : 0;
	to->camera_count = known ? from->camera_count : 0;
	to->confidence = known ? from->confidence : 0;
	to->gone = from->flags & MARKER_GONE;
	to->ghost = from->flags & MARKER_GHOST;
	to->n_stabilised_m = known && from->flags & MARKER_STABILISED ? 3 : 0;
	to->n_normalised_m = known && from->flags & MARKER_NORMALISED ? 3 : 0;
	memcpy(e->stabilised_m[slot], from->stabilised_m, sizeof(from->stabilised_m));
	memcpy(e->normalised_m[slot], from->normalised_m, sizeof(from->normalised_m));
}

static void fill_set(struct encoder *e, const struct marker_set *from, int64_t sent_ns)
{
	Stage__V1__MarkerSet *to = &e->set;

	to->shot = from->shot;
	to->mid_exposure_ns = from->mid_exposure_ns;
	to->uncertainty_ns = from->uncertainty_ns;
	to->missing_mask = from->missing_mask;
	to->arrival_ns = from->arrival_ns;
	to->found_ns = from->found_ns;
	to->solved_ns = from->solved_ns;
	to->sent_ns = sent_ns;
	to->markers_lost = from->markers_lost;
	to->rig_serial = from->rig_serial;
	to->hd = from->is_hd ? &e->hd : NULL;
	e->hd.index = from->hd_index;
	e->hd.phase = from->hd_phase;
	e->hd.mid_exposure_ns = from->hd_mid_exposure_ns;
	to->n_heads = 0;
	for (uint32_t i = 0; i < from->head_count; i++)
		if (from->heads[i].valid)
			fill_head(e, (uint32_t)to->n_heads++, i, &from->heads[i]);
	to->n_markers = from->marker_count;
	for (uint32_t i = 0; i < from->marker_count; i++)
		fill_marker(e, i, &from->markers[i]);
}

uint8_t *encode_marker_set(struct encoder *encoder, const struct marker_set *set, int64_t sent_ns,
			   size_t *size_bytes)
{
	assert(set->marker_count <= MARKER_MAX && set->head_count <= HEAD_MAX);
	fill_set(encoder, set, sent_ns);
	*size_bytes =
		FRAME_HEADER_BYTES +
		stage__v1__message__pack(&encoder->message, encoder->frame + FRAME_HEADER_BYTES);
	write_header(encoder->frame, *size_bytes);
	return encoder->frame;
}

size_t frame_set_sets_lost(uint8_t *frame, size_t size_bytes, uint64_t sets_lost)
{
	if (sets_lost) {
		frame[size_bytes++] = TAG_SETS_LOST;
		for (; sets_lost >= 0x80; sets_lost >>= 7)
			frame[size_bytes++] = (uint8_t)(sets_lost | 0x80);
		frame[size_bytes++] = (uint8_t)sets_lost;
	}
	write_header(frame, size_bytes);
	return size_bytes;
}

int encode_frame(const Stage__V1__Message *message, uint8_t **frame, size_t *size_bytes)
{
	size_t size = FRAME_HEADER_BYTES + stage__v1__message__get_packed_size(message);
	uint8_t *bytes = malloc(size);

	if (!bytes)
		return -ENOMEM;
	stage__v1__message__pack(message, bytes + FRAME_HEADER_BYTES);
	write_header(bytes, size);
	*frame = bytes;
	*size_bytes = size;
	return 0;
}

/* Message structs of one description, chained to each other. */
struct description_parts {
	Stage__V1__Clock clock;
	Stage__V1__Camera cameras[CAMERA_MAX], *camera_pointers[CAMERA_MAX];
	Stage__V1__Actor actors[ACTOR_MAX], *actor_pointers[ACTOR_MAX];
	Stage__V1__LayoutMarker markers[LABEL_MAX], *marker_pointers[LABEL_MAX];
	double neutral_m[LABEL_MAX][3];
};

/* UTC is read between two readings of the station's clock; half their distance is the bound. */
static void fill_clock(Stage__V1__Clock *clock)
{
	struct timespec utc;
	int64_t before_ns = clock_now_ns();

	clock_gettime(CLOCK_REALTIME, &utc);
	int64_t after_ns = clock_now_ns();
	stage__v1__clock__init(clock);
	clock->name = encode_text("CLOCK_MONOTONIC");
	clock->utc_offset_ns =
		utc.tv_sec * NS_PER_S + utc.tv_nsec - (before_ns + (after_ns - before_ns) / 2);
	clock->uncertainty_ns = (after_ns - before_ns) / 2 + 1;
}

static void fill_camera(Stage__V1__Camera *to, const struct stream_camera *from)
{
	stage__v1__camera__init(to);
	to->name = encode_text(from->name);
	to->role =
		from->is_hd ? STAGE__V1__CAMERA__ROLE__ROLE_HD : STAGE__V1__CAMERA__ROLE__ROLE_IR;
	to->width_px = from->width_px;
	to->height_px = from->height_px;
}

static void fill_label(Stage__V1__LayoutMarker *to, double neutral_m[3],
		       const struct layout_marker *from)
{
	stage__v1__layout_marker__init(to);
	to->name = encode_text(from->name);
	to->group = encode_text(from->group);
	to->segment = encode_text(from->segment);
	to->rigid = from->rigid;
	to->diameter_m = from->diameter_m;
	neutral_m[0] = from->neutral_m.x;
	neutral_m[1] = from->neutral_m.y;
	neutral_m[2] = from->neutral_m.z;
	to->n_neutral_m = 3;
	to->neutral_m = neutral_m;
}

static void fill_actors(struct description_parts *parts, const struct layout *layout)
{
	for (uint32_t i = 0; i < layout->marker_count; i++) {
		parts->marker_pointers[i] = &parts->markers[i];
		fill_label(&parts->markers[i], parts->neutral_m[i], &layout->markers[i]);
	}
	for (uint32_t a = 0; a < layout->actor_count; a++) {
		Stage__V1__Actor *to = parts->actor_pointers[a] = &parts->actors[a];

		stage__v1__actor__init(to);
		to->name = encode_text(layout->actors[a].name);
		to->n_markers = layout->actors[a].count;
		to->markers = parts->marker_pointers + layout->actors[a].first;
	}
}

static void fill_description(Stage__V1__Description *to, struct description_parts *parts,
			     const struct stream_description *from)
{
	stage__v1__description__init(to);
	to->protocol_version = PROTOCOL_VERSION;
	to->station_version = encode_text(from->station_version);
	to->length_unit = encode_text("m");
	to->handedness = encode_text("right");
	to->stage_axes = encode_text("z up");
	to->head_axes = encode_text("x to the subject's left, y up, z out of the face");
	to->rig_revision = encode_text(from->rig_revision);
	to->rig_serial = from->rig_serial;
	to->run = from->run;
	to->period_ns = from->period_ns;
	to->n_cameras = from->camera_count;
	to->cameras = parts->camera_pointers;
	for (uint32_t i = 0; i < from->camera_count; i++) {
		parts->camera_pointers[i] = &parts->cameras[i];
		fill_camera(&parts->cameras[i], &from->cameras[i]);
	}
	fill_actors(parts, from->layout);
	to->n_actors = from->layout->actor_count;
	to->actors = parts->actor_pointers;
	fill_clock(&parts->clock);
	to->clock = &parts->clock;
}

int encode_description(const struct stream_description *description, uint8_t **frame,
		       size_t *size_bytes)
{
	Stage__V1__Message message = STAGE__V1__MESSAGE__INIT;
	Stage__V1__Description body;
	struct description_parts *parts = malloc(sizeof(*parts));

	if (!parts)
		return -ENOMEM;
	fill_description(&body, parts, description);
	message.body_case = STAGE__V1__MESSAGE__BODY_DESCRIPTION;
	message.description = &body;
	int r = encode_frame(&message, frame, size_bytes);
	free(parts);
	return r;
}

int encode_notice(enum notice_kind kind, const char *words, uint8_t **frame, size_t *size_bytes)
{
	Stage__V1__Message message = STAGE__V1__MESSAGE__INIT;
	Stage__V1__Notice notice = STAGE__V1__NOTICE__INIT;

	notice.kind = (Stage__V1__Notice__Kind)kind;
	notice.text = encode_text(words);
	message.body_case = STAGE__V1__MESSAGE__BODY_NOTICE;
	message.notice = &notice;
	return encode_frame(&message, frame, size_bytes);
}
