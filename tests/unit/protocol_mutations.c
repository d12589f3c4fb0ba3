/*
 * The fuzz target over valid streams with random damage: it must neither crash nor read astray.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/rng.h"
#include "tests/fuzz/fuzz_stream.h"
#include "tests/unit/sample_stream.h"

#define STREAM_BYTES (64u << 10)
#define CHILDREN 30
#define RUNS \
	2000 /* of each; an emulated process (QEMU) keeps 0.4 MB for every decoder that it had */

static uint8_t seed_stream[STREAM_BYTES];
static size_t seed_bytes;

static void add_frame(const uint8_t *frame, size_t size_bytes)
{
	assert_true(seed_bytes + size_bytes <= STREAM_BYTES);
	memcpy(seed_stream + seed_bytes, frame, size_bytes);
	seed_bytes += size_bytes;
}

static int make_seed_stream(void **state)
{
	static struct layout layout;
	static struct marker_set set;
	struct encoder *encoder;
	uint8_t *frame;
	size_t size_bytes;

	(void)state;
	sample_layout(&layout);
	layout.marker_count = layout.actors[0].count = 6;
	struct stream_description description = sample_description(&layout);
	assert_int_equal(encode_description(&description, &frame, &size_bytes), 0);
	add_frame(frame, size_bytes);
	free(frame);
	assert_int_equal(encode_notice(NOTICE_REFUSED, "no", &frame, &size_bytes), 0);
	add_frame(frame, size_bytes);
	free(frame);
	assert_int_equal(encoder_create(&encoder), 0);
	sample_set(&set, 7, 0);
	set.marker_count = 6;
	frame = encode_marker_set(encoder, &set, 1, &size_bytes);
	size_bytes = frame_set_sets_lost(frame, size_bytes, 300);
	add_frame(frame, size_bytes);
	encoder_destroy(encoder);
	return 0;
}

static uint32_t below(struct rng *rng, size_t limit)
{
	return rng_u32(rng) % (uint32_t)limit;
}

/* Flips, overwrites, removes or repeats a few bytes. */
static size_t damage(struct rng *rng, uint8_t *bytes, size_t size)
{
	for (uint32_t n = 1 + below(rng, 6); n > 0 && size > 8; n--) {
		uint32_t at = below(rng, size), length = 1 + below(rng, 8);

		if (at + length > size)
			length = (uint32_t)size - at;
		switch (below(rng, 4)) {
		case 0:
			bytes[at] ^= (uint8_t)(1u << below(rng, 8));
			break;
		case 1:
			bytes[at] = (uint8_t)(below(rng, 2) ? 0xff : rng_u32(rng));
			break;
		case 2:
			memmove(bytes + at, bytes + at + length, size - at - length);
			size -= length;
			break;
		default:
			memmove(bytes + at, bytes + below(rng, size - length + 1), length);
		}
	}
	return size;
}

static void decode_damaged_streams(uint64_t seed)
{
	static uint8_t bytes[STREAM_BYTES];
	struct rng rng;

	rng_init(&rng, seed, 0);
	for (int run = 0; run < RUNS; run++) {
		memcpy(bytes, seed_stream, seed_bytes);
		size_t size = damage(&rng, bytes, seed_bytes);
		LLVMFuzzerTestOneInput(bytes, size);
	}
}

static void damaged_streams_never_crash_the_decoder(void **state)
{
	(void)state;
	for (uint64_t seed = 1; seed <= CHILDREN; seed++) {
		int status;
		pid_t child = fork();

		if (child == 0) {
			decode_damaged_streams(seed);
			_exit(0);
		}
		assert_int_equal(waitpid(child, &status, 0), child);
		if (status)
			print_message("# damage of seed %d: status %#x\n", (int)seed, status);
		assert_int_equal(status, 0);
	}
}

static void every_truncation_is_survived(void **state)
{
	(void)state;
	for (size_t size = 0; size <= seed_bytes; size++) {
		uint8_t *exact =
			malloc(size + 1); /* so that a memory checker sees one byte too far */

		memcpy(exact, seed_stream, size);
		assert_int_equal(LLVMFuzzerTestOneInput(exact, size), 0);
		free(exact);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(damaged_streams_never_crash_the_decoder),
		cmocka_unit_test(every_truncation_is_survived),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("protocol_mutations", tests, make_seed_stream, NULL);
}
