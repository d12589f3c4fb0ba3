/*
 * Unpacks with protobuf-c into an arena that is reset for each message: one bound for all that a
 * message may make us allocate. There are two arenas, because a description stays valid while
 * marker sets come and go: the one it was decoded in is put aside until the next description.
 */
#include "protocol/decode.h"

#include <errno.h>
#include <math.h>
#include <stdalign.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "protocol/decode_parts.h"

#define ARENA_BYTES (64u << 20) /* address space: the kernel gives memory only as it is touched */

#define CAMERAS_MAX 1024
#define ACTORS_MAX 1024
#define LABELS_MAX 65536
#define MARKERS_MAX 65536
#define HEADS_MAX 1024

struct arena {
	uint8_t *bytes; /* owned */
	size_t used;
};

struct decoder {
	struct arena message;
	struct arena description;                /* holds what `current` points to */
	const struct stage_description *current; /* NULL until the first description */
};

static int arena_init(struct arena *arena)
{
	void *bytes = mmap(NULL, ARENA_BYTES, PROT_READ | PROT_WRITE,
			   MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);

	if (bytes == MAP_FAILED)
		return -ENOMEM;
	arena->bytes = bytes;
	return 0;
}

static void arena_finish(struct arena *arena)
{
	if (arena->bytes)
		munmap(arena->bytes, ARENA_BYTES);
}

void *decode_alloc(void *user, size_t size)
{
	struct arena *arena = user;
	size_t start = (arena->used + alignof(max_align_t) - 1) & ~(alignof(max_align_t) - 1);

	if (start > ARENA_BYTES || size > ARENA_BYTES - start)
		return NULL;
	arena->used = start + size;
	return arena->bytes + start;
}

static void arena_free(void *user, void *pointer)
{
	(void)user;
	(void)pointer;
}

int decoder_create(struct decoder **out)
{
	struct decoder *decoder = calloc(1, sizeof(*decoder));

	if (!decoder)
		return -ENOMEM;
	if (arena_init(&decoder->message) < 0 || arena_init(&decoder->description) < 0) {
		decoder_destroy(decoder);
		return -ENOMEM;
	}
	*out = decoder;
	return 0;
}

void decoder_destroy(struct decoder *decoder)
{
	if (!decoder)
		return;
	arena_finish(&decoder->message);
	arena_finish(&decoder->description);
	free(decoder);
}

bool decode_text_is_clean(const char *text)
{
	for (; *text; text++)
		if ((unsigned char)*text < 0x20 || *text == 0x7f)
			return false;
	return true;
}

static int decode_cameras(struct arena *arena, const Stage__V1__Description *from,
			  struct stage_description *to)
{
	struct stage_camera *cameras = decode_alloc(arena, from->n_cameras * sizeof(*cameras));

	if (from->n_cameras > CAMERAS_MAX || !cameras)
		return -EPROTO;
	for (size_t i = 0; i < from->n_cameras; i++) {
		const Stage__V1__Camera *camera = from->cameras[i];

		if (!decode_text_is_clean(camera->name))
			return -EPROTO;
		cameras[i] = (struct stage_camera){.name = camera->name,
						   .is_hd = camera->role ==
							    STAGE__V1__CAMERA__ROLE__ROLE_HD,
						   .width_px = camera->width_px,
						   .height_px = camera->height_px};
	}
	to->camera_count = (uint32_t)from->n_cameras;
	to->cameras = cameras;
	return 0;
}

static int decode_label(const Stage__V1__LayoutMarker *from, uint32_t actor, struct stage_label *to)
{
	if (!decode_text_is_clean(from->name) || !decode_text_is_clean(from->group) ||
	    !decode_text_is_clean(from->segment) || from->n_neutral_m != 3)
		return -EPROTO;
	*to = (struct stage_label){.name = from->name,
				   .group = from->group,
				   .segment = from->segment,
				   .actor = actor,
				   .rigid = from->rigid,
				   .diameter_m = from->diameter_m};
	memcpy(to->neutral_m, from->neutral_m, sizeof(to->neutral_m));
	return 0;
}

static size_t count_labels(const Stage__V1__Description *from)
{
	size_t count = 0;

	for (size_t i = 0; i < from->n_actors; i++)
		count += from->actors[i]->n_markers;
	return count;
}

static int decode_actors(struct arena *arena, const Stage__V1__Description *from,
			 struct stage_description *to)
{
	size_t label_count = count_labels(from), next = 0;
	const char **actors = decode_alloc(arena, from->n_actors * sizeof(*actors));
	struct stage_label *labels = decode_alloc(arena, label_count * sizeof(*labels));

	if (from->n_actors > ACTORS_MAX || label_count > LABELS_MAX || !actors || !labels)
		return -EPROTO;
	for (size_t i = 0; i < from->n_actors; i++) {
		const Stage__V1__Actor *actor = from->actors[i];

		if (!decode_text_is_clean(actor->name))
			return -EPROTO;
		actors[i] = actor->name;
		for (size_t k = 0; k < actor->n_markers; k++)
			if (decode_label(actor->markers[k], (uint32_t)i, &labels[next++]) < 0)
				return -EPROTO;
	}
	to->actor_count = (uint32_t)from->n_actors;
	to->actors = actors;
	to->label_count = (uint32_t)label_count;
	to->labels = labels;
	return 0;
}

static bool texts_are_clean(const Stage__V1__Description *d)
{
	return decode_text_is_clean(d->station_version) && decode_text_is_clean(d->length_unit) &&
	       decode_text_is_clean(d->handedness) && decode_text_is_clean(d->stage_axes) &&
	       decode_text_is_clean(d->head_axes) && decode_text_is_clean(d->rig_revision);
}

/* The arena that the description lies in is put aside, and the other one is used from now on. */
static void keep_description(struct decoder *decoder, const struct stage_description *description)
{
	struct arena kept = decoder->message;

	decoder->message = decoder->description;
	decoder->description = kept;
	decoder->current = description;
}

static int decode_description(struct decoder *decoder, const Stage__V1__Description *from,
			      struct stage_event *event)
{
	struct stage_description *to = decode_alloc(&decoder->message, sizeof(*to));

	if (!to || !texts_are_clean(from))
		return -EPROTO;
	*to = (struct stage_description){
		.protocol_version = from->protocol_version,
		.station_version = from->station_version,
		.length_unit = from->length_unit,
		.handedness = from->handedness,
		.stage_axes = from->stage_axes,
		.head_axes = from->head_axes,
		.rig_revision = from->rig_revision,
		.rig_serial = from->rig_serial,
		.run = from->run,
		.period_ns = from->period_ns,
		.utc_offset_ns = from->clock ? from->clock->utc_offset_ns : 0,
		.utc_uncertainty_ns = from->clock ? from->clock->uncertainty_ns : INT64_MAX};
	if (decode_cameras(&decoder->message, from, to) < 0 ||
	    decode_actors(&decoder->message, from, to) < 0)
		return -EPROTO;
	keep_description(decoder, to);
	*event = (struct stage_event){.kind = STAGE_DESCRIPTION, .description = to};
	return 0;
}

static int decode_heads(struct decoder *decoder, const Stage__V1__MarkerSet *from,
			struct stage_marker_set *to)
{
	struct stage_head *heads = decode_alloc(&decoder->message, from->n_heads * sizeof(*heads));

	if (from->n_heads > HEADS_MAX || !heads)
		return -EPROTO;
	for (size_t i = 0; i < from->n_heads; i++) {
		const Stage__V1__Head *head = from->heads[i];

		if (head->n_q_wxyz != 4 || head->n_t_m != 3 ||
		    head->actor >= decoder->current->actor_count)
			return -EPROTO;
		heads[i] = (struct stage_head){.actor = head->actor,
					       .residual_m = head->residual_m,
					       .rigid_count = head->rigid_count,
					       .jig_slip = head->jig_slip,
					       .slip_m = head->slip_m};
		memcpy(heads[i].q_wxyz, head->q_wxyz, sizeof(heads[i].q_wxyz));
		memcpy(heads[i].t_m, head->t_m, sizeof(heads[i].t_m));
	}
	to->head_count = (uint32_t)from->n_heads;
	to->heads = heads;
	return 0;
}

/* Three coordinates, or none. */
static int decode_layer(const float *from, size_t count, float to_m[3])
{
	if (count != 0 && count != 3)
		return -EPROTO;
	for (int i = 0; i < 3; i++)
		to_m[i] = count ? from[i] : NAN;
	return 0;
}

static int decode_marker(const Stage__V1__Marker *from, uint32_t label_count,
			 struct stage_marker *to)
{
	if (from->label < STAGE_LABEL_NONE || (int64_t)from->label >= (int64_t)label_count ||
	    (from->n_cov_m2 != 0 && from->n_cov_m2 != 6))
		return -EPROTO;
	*to = (struct stage_marker){.label = from->label,
				    .status = from->status,
				    .p_m = {from->x_m, from->y_m, from->z_m},
				    .residual_px = from->residual_px,
				    .camera_mask = from->camera_mask,
				    .camera_count = from->camera_count,
				    .confidence = from->confidence,
				    .gone = from->gone,
				    .ghost = from->ghost};
	if (to->status == STAGE_MISSING)
		to->p_m[0] = to->p_m[1] = to->p_m[2] = NAN;
	for (int i = 0; i < 6; i++)
		to->cov_m2[i] = from->n_cov_m2 ? from->cov_m2[i] : NAN;
	if (decode_layer(from->stabilised_m, from->n_stabilised_m, to->stabilised_m) < 0)
		return -EPROTO;
	return decode_layer(from->normalised_m, from->n_normalised_m, to->normalised_m);
}

static int decode_markers(struct decoder *decoder, const Stage__V1__MarkerSet *from,
			  struct stage_marker_set *to)
{
	struct stage_marker *markers =
		decode_alloc(&decoder->message, from->n_markers * sizeof(*markers));

	if (from->n_markers > MARKERS_MAX || !markers)
		return -EPROTO;
	for (size_t i = 0; i < from->n_markers; i++)
		if (decode_marker(from->markers[i], decoder->current->label_count, &markers[i]) < 0)
			return -EPROTO;
	to->marker_count = (uint32_t)from->n_markers;
	to->markers = markers;
	return 0;
}

static int decode_set(struct decoder *decoder, const Stage__V1__Message *message,
		      struct stage_event *event)
{
	const Stage__V1__MarkerSet *from = message->markers;
	struct stage_marker_set *to = decode_alloc(&decoder->message, sizeof(*to));

	if (!decoder->current || !to)
		return -EPROTO;
	*to = (struct stage_marker_set){.shot = from->shot,
					.mid_exposure_ns = from->mid_exposure_ns,
					.uncertainty_ns = from->uncertainty_ns,
					.missing_mask = from->missing_mask,
					.arrival_ns = from->arrival_ns,
					.found_ns = from->found_ns,
					.solved_ns = from->solved_ns,
					.sent_ns = from->sent_ns,
					.markers_lost = from->markers_lost,
					.rig_serial = from->rig_serial,
					.sets_lost = message->sets_lost};
	if (from->hd) {
		to->is_hd = true;
		to->hd_index = from->hd->index;
		to->hd_phase = from->hd->phase;
		to->hd_mid_exposure_ns = from->hd->mid_exposure_ns;
	}
	if (decode_heads(decoder, from, to) < 0 || decode_markers(decoder, from, to) < 0)
		return -EPROTO;
	*event = (struct stage_event){.kind = STAGE_MARKERS, .markers = to};
	return 0;
}

static int decode_notice(struct decoder *decoder, const Stage__V1__Notice *from,
			 struct stage_event *event)
{
	struct stage_notice *to = decode_alloc(&decoder->message, sizeof(*to));

	if (!to || !decode_text_is_clean(from->text))
		return -EPROTO;
	*to = (struct stage_notice){.kind = from->kind, .text = from->text};
	*event = (struct stage_event){.kind = STAGE_NOTICE, .notice = to};
	return 0;
}

int decode_message(struct decoder *decoder, const uint8_t *bytes, size_t size_bytes,
		   struct stage_event *event)
{
	ProtobufCAllocator allocator = {decode_alloc, arena_free, &decoder->message};

	decoder->message.used = 0;
	const Stage__V1__Message *message =
		stage__v1__message__unpack(&allocator, size_bytes, bytes);
	if (!message)
		return -EPROTO;
	switch (message->body_case) {
	case STAGE__V1__MESSAGE__BODY_DESCRIPTION:
		return decode_description(decoder, message->description, event);
	case STAGE__V1__MESSAGE__BODY_MARKERS:
		return decode_set(decoder, message, event);
	case STAGE__V1__MESSAGE__BODY_NOTICE:
		return decode_notice(decoder, message->notice, event);
	case STAGE__V1__MESSAGE__BODY_STATISTICS:
		return decode_statistics(&decoder->message, message->statistics, event);
	default:
		*event = (struct stage_event){.kind = STAGE_UNKNOWN};
		return 0;
	}
}
