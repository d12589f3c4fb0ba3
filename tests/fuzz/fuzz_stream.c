/*
 * What a subscriber may be sent: a sequence of frames. Touches everything that decoding hands out.
 * With libFuzzer: build this file, protocol/decode.c and stage.pb-c.c by clang with
 * -fsanitize=fuzzer,address; tests/unit/protocol_mutations.c runs it over mutated streams.
 */
#include "tests/fuzz/fuzz_stream.h"

#include <assert.h>
#include <string.h>

#include "protocol/decode.h"

static size_t touch_description(const struct stage_description *d)
{
	size_t sum = strlen(d->station_version) + strlen(d->rig_revision) + strlen(d->head_axes);

	for (uint32_t i = 0; i < d->camera_count; i++)
		sum += strlen(d->cameras[i].name);
	for (uint32_t i = 0; i < d->label_count; i++)
		sum += strlen(d->labels[i].name) + strlen(d->labels[i].group) +
		       strlen(d->actors[d->labels[i].actor]);
	return sum;
}

static size_t touch_set(const struct stage_marker_set *set, const struct stage_description *d)
{
	size_t sum = 0;

	for (uint32_t i = 0; i < set->head_count; i++)
		sum += strlen(d->actors[set->heads[i].actor]);
	for (uint32_t i = 0; i < set->marker_count; i++)
		if (set->markers[i].label != STAGE_LABEL_NONE)
			sum += strlen(d->labels[set->markers[i].label].name);
	return sum;
}

/* Keeps the compiler from leaving the reads away. */
static volatile size_t touched;

static int decode_frame(struct decoder *decoder, const uint8_t *bytes, size_t size_bytes,
			const struct stage_description **description)
{
	struct stage_event event;
	int r = decode_message(decoder, bytes, size_bytes, &event);

	if (r < 0)
		return r;
	if (event.kind == STAGE_DESCRIPTION) {
		*description = event.description;
		touched += touch_description(event.description);
	} else if (event.kind == STAGE_MARKERS) {
		assert(*description);
		touched += touch_set(event.markers, *description);
	} else if (event.kind == STAGE_NOTICE) {
		touched += strlen(event.notice->text);
	}
	return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const struct stage_description *description = NULL;
	struct decoder *decoder;

	if (decoder_create(&decoder) < 0)
		return 0;
	while (size >= 4) {
		uint32_t wanted = (uint32_t)data[0] | (uint32_t)data[1] << 8 |
				  (uint32_t)data[2] << 16 | (uint32_t)data[3] << 24;
		size_t body = wanted < size - 4 ? wanted : size - 4;

		if (decode_frame(decoder, data + 4, body, &description) < 0)
			break;
		data += 4 + body;
		size -= 4 + body;
	}
	decoder_destroy(decoder);
	return 0;
}
