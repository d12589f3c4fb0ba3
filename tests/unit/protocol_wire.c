/*
 * What the station encodes is what a subscriber decodes; what is not valid is refused.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <time.h>

#include "base/clock.h"
#include "protocol/decode.h"
#include "tests/unit/sample_stream.h"

/* Counts allocations of the whole program, libraries included. */
extern void *__libc_malloc(size_t size);
void *malloc(size_t size);
static unsigned malloc_count;

void *malloc(size_t size)
{
	malloc_count++;
	return __libc_malloc(size);
}

struct wire {
	struct layout layout;
	struct marker_set set;
	struct encoder *encoder;
	struct decoder *decoder;
	struct stage_event event;
};

static int set_up(void **state)
{
	struct wire *wire = calloc(1, sizeof(*wire));

	sample_layout(&wire->layout);
	assert_int_equal(encoder_create(&wire->encoder), 0);
	assert_int_equal(decoder_create(&wire->decoder), 0);
	*state = wire;
	return 0;
}

static int tear_down(void **state)
{
	struct wire *wire = *state;

	encoder_destroy(wire->encoder);
	decoder_destroy(wire->decoder);
	free(wire);
	return 0;
}

static int decode_frame(struct wire *wire, const uint8_t *frame, size_t size_bytes)
{
	size_t body = (size_t)frame[0] | (size_t)frame[1] << 8 | (size_t)frame[2] << 16;

	assert_int_equal(body, size_bytes - FRAME_HEADER_BYTES);
	return decode_message(wire->decoder, frame + FRAME_HEADER_BYTES, body, &wire->event);
}

static void describe(struct wire *wire)
{
	struct stream_description description = sample_description(&wire->layout);
	uint8_t *frame;
	size_t size_bytes;

	assert_int_equal(encode_description(&description, &frame, &size_bytes), 0);
	assert_int_equal(decode_frame(wire, frame, size_bytes), 0);
	free(frame);
}

static int send_set(struct wire *wire)
{
	size_t size_bytes;
	uint8_t *frame = encode_marker_set(wire->encoder, &wire->set, 77, &size_bytes);

	return decode_frame(wire, frame, size_bytes);
}

static void description_survives_the_wire(void **state)
{
	struct wire *wire = *state;

	describe(wire);
	assert_int_equal(wire->event.kind, STAGE_DESCRIPTION);
	const struct stage_description *d = wire->event.description;
	assert_int_equal(d->protocol_version, PROTOCOL_VERSION);
	assert_string_equal(d->station_version, "0.1.0");
	assert_string_equal(d->length_unit, "m");
	assert_string_equal(d->rig_revision, "00c0ffee00c0ffee");
	assert_int_equal(d->period_ns, 8333333);
	assert_int_equal(d->camera_count, 2);
	assert_string_equal(d->cameras[1].name, "hd1");
	assert_true(d->cameras[1].is_hd);
	assert_int_equal(d->cameras[1].width_px, 1920);
	assert_string_equal(d->actors[0], "anna");
	assert_int_equal(d->label_count, SAMPLE_LABELS);
	assert_string_equal(d->labels[73].name, "marker_73");
	assert_string_equal(d->labels[73].group, "face");
	assert_true(d->labels[3].rigid && !d->labels[4].rigid);
	assert_true(d->labels[73].neutral_m[1] == -0.002 * 73);
}

static void description_ties_the_clock_to_utc(void **state)
{
	struct wire *wire = *state;
	struct timespec utc;

	describe(wire);
	clock_gettime(CLOCK_REALTIME, &utc);
	int64_t utc_ns = clock_now_ns() + wire->event.description->utc_offset_ns;
	assert_true(llabs(utc_ns - (utc.tv_sec * NS_PER_S + utc.tv_nsec)) < 100 * NS_PER_MS);
}

static void check_marker(const struct stage_marker *got, const struct marker *sent)
{
	assert_int_equal(got->label, sent->label);
	assert_int_equal(got->status, sent->status);
	assert_int_equal(got->gone, (sent->flags & MARKER_GONE) != 0);
	assert_int_equal(got->ghost, (sent->flags & MARKER_GHOST) != 0);
	for (int k = 0; k < 3 && sent->flags & MARKER_NORMALISED; k++)
		assert_true(got->stabilised_m[k] == sent->stabilised_m[k] &&
			    got->normalised_m[k] == sent->normalised_m[k]);
	if (!(sent->flags & MARKER_NORMALISED))
		assert_true(isnan(got->stabilised_m[0]) && isnan(got->normalised_m[2]));
	if (sent->status == MARKER_MISSING) {
		assert_true(isnan(got->p_m[0]) && isnan(got->cov_m2[0]));
		return;
	}
	assert_true(got->p_m[0] == sent->p_stage_m.x && got->p_m[1] == sent->p_stage_m.y &&
		    got->p_m[2] == sent->p_stage_m.z);
	for (int k = 0; k < 6; k++)
		assert_true(got->cov_m2[k] == (float)sent->cov_m2[k]);
	assert_true(got->residual_px == sent->residual_px);
	assert_true(got->confidence == sent->confidence);
	assert_int_equal(got->camera_mask, sent->camera_mask);
	assert_int_equal(got->camera_count, sent->camera_count);
}

static void several_actors_have_labels_one_after_the_other(void **state)
{
	struct wire *wire = *state;
	struct layout *layout = &wire->layout;

	layout->actor_count = 2;
	layout->actors[0].count = 30;
	layout->actors[1] = (struct layout_actor){"ben", 30, SAMPLE_LABELS - 30};
	strcpy(layout->markers[40].segment, "torso");
	describe(wire);
	const struct stage_description *d = wire->event.description;
	assert_int_equal(d->actor_count, 2);
	assert_string_equal(d->actors[1], "ben");
	assert_int_equal(d->label_count, SAMPLE_LABELS);
	assert_int_equal(d->labels[29].actor, 0);
	assert_int_equal(d->labels[30].actor, 1);
	assert_string_equal(d->labels[40].segment, "torso");
	assert_string_equal(d->labels[41].segment, "");
	sample_set(&wire->set, 1, 0);
	wire->set.head_count = 2;
	wire->set.heads[1] = wire->set.heads[0];
	wire->set.heads[0].valid = 0;
	assert_int_equal(send_set(wire), 0);
	assert_int_equal(wire->event.markers->head_count, 1);
	assert_int_equal(wire->event.markers->heads[0].actor, 1);
}

static void marker_set_survives_the_wire(void **state)
{
	struct wire *wire = *state;

	describe(wire);
	sample_set(&wire->set, 12345, 5);
	wire->set.markers_lost = 3;
	wire->set.rig_serial = 6;
	assert_int_equal(send_set(wire), 0);
	const struct stage_marker_set *got = wire->event.markers;
	assert_int_equal(got->shot, 12345);
	assert_int_equal(got->mid_exposure_ns, wire->set.mid_exposure_ns);
	assert_int_equal(got->rig_serial, 6);
	assert_int_equal(got->uncertainty_ns, wire->set.uncertainty_ns);
	assert_int_equal(got->missing_mask, 2);
	assert_int_equal(got->arrival_ns, wire->set.arrival_ns);
	assert_int_equal(got->found_ns, wire->set.found_ns);
	assert_int_equal(got->solved_ns, wire->set.solved_ns);
	assert_int_equal(got->sent_ns, 77);
	assert_int_equal(got->markers_lost, 3);
	assert_int_equal(got->head_count, 1);
	assert_true(got->heads[0].q_wxyz[0] == 1.0 && got->heads[0].t_m[2] == 1.5);
	assert_int_equal(got->heads[0].rigid_count, 4);
	assert_true(got->heads[0].jig_slip && got->heads[0].slip_m == 0.003);
	assert_int_equal(got->marker_count, SAMPLE_LABELS + 5);
	for (uint32_t i = 0; i < got->marker_count; i++)
		check_marker(&got->markers[i], &wire->set.markers[i]);
}

static void hd_frame_is_named_in_hd_shots_alone(void **state)
{
	struct wire *wire = *state;

	describe(wire);
	sample_set(&wire->set, 42, 0);
	assert_int_equal(send_set(wire), 0);
	assert_false(wire->event.markers->is_hd);
	wire->set.is_hd = 1;
	wire->set.hd_index = 0; /* a number that takes no room on the wire */
	wire->set.hd_phase = 0;
	assert_int_equal(send_set(wire), 0);
	assert_true(wire->event.markers->is_hd);
	wire->set.hd_index = 10;
	wire->set.hd_phase = 2;
	wire->set.hd_mid_exposure_ns = -12345;
	assert_int_equal(send_set(wire), 0);
	assert_int_equal(wire->event.markers->hd_index, 10);
	assert_int_equal(wire->event.markers->hd_phase, 2);
	assert_int_equal(wire->event.markers->hd_mid_exposure_ns, -12345);
}

static void head_that_could_not_be_fitted_is_left_out(void **state)
{
	struct wire *wire = *state;

	describe(wire);
	sample_set(&wire->set, 1, 0);
	wire->set.heads[0].valid = 0;
	assert_int_equal(send_set(wire), 0);
	assert_int_equal(wire->event.markers->head_count, 0);
}

static void fullest_set_with_the_longest_numbers_fits(void **state)
{
	struct wire *wire = *state;

	describe(wire);
	sample_set(&wire->set, UINT64_MAX, MARKER_MAX - SAMPLE_LABELS);
	wire->set.mid_exposure_ns = wire->set.arrival_ns = wire->set.solved_ns = INT64_MIN;
	wire->set.missing_mask = wire->set.markers_lost = UINT32_MAX;
	wire->set.is_hd = wire->set.hd_phase = UINT32_MAX;
	wire->set.hd_index = UINT64_MAX;
	for (uint32_t i = 0; i < MARKER_MAX; i++) {
		wire->set.markers[i].status = MARKER_MEASURED;
		wire->set.markers[i].camera_mask = UINT32_MAX;
		wire->set.markers[i].camera_count = 255;
	}
	assert_int_equal(send_set(wire), 0);
	assert_int_equal(wire->event.markers->marker_count, MARKER_MAX);
}

static void loss_count_is_put_behind_a_finished_frame(void **state)
{
	const uint64_t counts[] = {0, 1, 127, 128, 300, UINT64_MAX, 0};
	struct wire *wire = *state;
	size_t size_bytes;

	describe(wire);
	sample_set(&wire->set, 1, 0);
	uint8_t *frame = encode_marker_set(wire->encoder, &wire->set, 77, &size_bytes);
	for (size_t i = 0; i < sizeof(counts) / sizeof(counts[0]); i++) {
		size_t own_bytes = frame_set_sets_lost(frame, size_bytes, counts[i]);

		assert_true(own_bytes <= size_bytes + FRAME_TAIL_BYTES);
		assert_int_equal(decode_frame(wire, frame, own_bytes), 0);
		assert_true(wire->event.markers->sets_lost == counts[i]);
	}
}

static void encoding_a_set_allocates_nothing(void **state)
{
	struct wire *wire = *state;
	size_t size_bytes;

	sample_set(&wire->set, 1, 100);
	unsigned before = malloc_count;
	encode_marker_set(wire->encoder, &wire->set, 77, &size_bytes);
	assert_int_equal(malloc_count, before);
	free(malloc(1)); /* the count does count */
	assert_int_equal(malloc_count, before + 1);
}

static void marker_set_before_a_description_is_refused(void **state)
{
	struct wire *wire = *state;

	sample_set(&wire->set, 1, 0);
	assert_int_equal(send_set(wire), -EPROTO);
}

static void label_beyond_the_description_is_refused(void **state)
{
	struct wire *wire = *state;

	describe(wire);
	sample_set(&wire->set, 1, 0);
	wire->set.markers[0].label = SAMPLE_LABELS;
	assert_int_equal(send_set(wire), -EPROTO);
	wire->set.markers[0].label = -2;
	assert_int_equal(send_set(wire), -EPROTO);
}

static void control_characters_in_a_name_are_refused(void **state)
{
	struct wire *wire = *state;
	struct stream_description description = sample_description(&wire->layout);
	uint8_t *frame;
	size_t size_bytes;

	strcpy(wire->layout.markers[9].name, "\033[2J");
	assert_int_equal(encode_description(&description, &frame, &size_bytes), 0);
	assert_int_equal(decode_frame(wire, frame, size_bytes), -EPROTO);
	free(frame);
}

/* Two bytes on the wire, a hundred in memory: the largest message would take a gigabyte. */
static void millions_of_empty_markers_are_refused(void **state)
{
	struct wire *wire = *state;
	size_t body = MESSAGE_BYTES_MAX - 6;
	uint8_t *bytes = malloc(MESSAGE_BYTES_MAX);

	describe(wire);
	bytes[0] = 2 << 3 | 2; /* Message.markers */
	for (int i = 0; i < 4; i++)
		bytes[1 + i] = (uint8_t)((body >> (7 * i) & 0x7f) | (i < 3 ? 0x80 : 0));
	for (size_t i = 0; i < body; i += 2) {
		bytes[5 + i] = 10 << 3 | 2; /* MarkerSet.markers */
		bytes[6 + i] = 0;
	}
	assert_int_equal(decode_message(wire->decoder, bytes, 5 + body, &wire->event), -EPROTO);
	free(bytes);
}

static void message_of_an_unknown_kind_is_passed_on_as_unknown(void **state)
{
	const uint8_t bytes[] = {9 << 3 | 2, 3, 'n', 'e', 'w'};
	struct wire *wire = *state;

	assert_int_equal(decode_message(wire->decoder, bytes, sizeof(bytes), &wire->event), 0);
	assert_int_equal(wire->event.kind, STAGE_UNKNOWN);
}

/* A cubic is met exactly; what is outside or missing is refused. */
static void places_between_shots_lie_on_the_cubic_through_four(void **state)
{
	const int64_t times_ns[4] = {1000, 2000, 3100, 4000};
	double p_m[4][3], out_m[3] = {7, 7, 7};

	(void)state;
	for (int i = 0; i < 4; i++) {
		double t = 1e-3 * (double)times_ns[i];

		p_m[i][0] = t;
		p_m[i][1] = 2 - t * t;
		p_m[i][2] = t * t * t;
	}
	assert_int_equal(stage_interpolate(times_ns, (const double(*)[3])p_m, 2500, out_m), 0);
	assert_true(fabs(out_m[0] - 2.5) < 1e-12 && fabs(out_m[1] + 4.25) < 1e-12 &&
		    fabs(out_m[2] - 15.625) < 1e-12);
	assert_int_equal(stage_interpolate(times_ns, (const double(*)[3])p_m, 4001, out_m), -EDOM);
	p_m[3][1] = NAN;
	assert_int_equal(stage_interpolate(times_ns, (const double(*)[3])p_m, 2500, out_m), -EDOM);
	assert_true(fabs(out_m[0] - 2.5) < 1e-12); /* untouched */
}

int main(void)
{
#define WIRE_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(places_between_shots_lie_on_the_cubic_through_four),
		WIRE_TEST(description_survives_the_wire),
		WIRE_TEST(description_ties_the_clock_to_utc),
		WIRE_TEST(several_actors_have_labels_one_after_the_other),
		WIRE_TEST(marker_set_survives_the_wire),
		WIRE_TEST(hd_frame_is_named_in_hd_shots_alone),
		WIRE_TEST(head_that_could_not_be_fitted_is_left_out),
		WIRE_TEST(fullest_set_with_the_longest_numbers_fits),
		WIRE_TEST(loss_count_is_put_behind_a_finished_frame),
		WIRE_TEST(encoding_a_set_allocates_nothing),
		WIRE_TEST(marker_set_before_a_description_is_refused),
		WIRE_TEST(label_beyond_the_description_is_refused),
		WIRE_TEST(control_characters_in_a_name_are_refused),
		WIRE_TEST(millions_of_empty_markers_are_refused),
		WIRE_TEST(message_of_an_unknown_kind_is_passed_on_as_unknown),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests_name("protocol_wire", tests, NULL, NULL);
}
