/*
 * The pool of HD frames: one writer, readers that hold what they read.
 */
#include "daemon/hd_pool.h"

#include <errno.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#define SLOTS 4
#define BYTES 10000

static struct hd_pool pool;

static int set_up(void **state)
{
	(void)state;
	return hd_pool_init(&pool, SLOTS, BYTES);
}

static int tear_down(void **state)
{
	(void)state;
	hd_pool_finish(&pool);
	return 0;
}

/* Every byte tells the frame's number. */
static bool write_frame(void)
{
	struct hd_frame *frame = hd_pool_claim(&pool);

	if (!frame)
		return false;
	frame->size_bytes = BYTES;
	frame->mid_exposure_ns = (int64_t)pool.next_seq;
	memset(frame->pixels, (int)(pool.next_seq & 0xff), BYTES);
	hd_pool_publish(&pool, frame);
	return true;
}

static bool frame_is_whole(const struct hd_frame *frame)
{
	for (size_t i = 0; i < frame->size_bytes; i++)
		if (frame->pixels[i] != (frame->seq & 0xff))
			return false;
	return frame->size_bytes == BYTES && frame->mid_exposure_ns == (int64_t)frame->seq;
}

static void expect_frame(uint64_t seq)
{
	const struct hd_frame *frame = hd_pool_hold(&pool, seq);

	assert_non_null(frame);
	assert_int_equal(frame->seq, seq);
	assert_true(frame_is_whole(frame));
	hd_pool_release(frame);
}

static void an_empty_pool_has_no_newest_frame(void **state)
{
	(void)state;
	assert_int_equal(hd_pool_newest(&pool), 0);
	assert_null(hd_pool_hold(&pool, 0));
	assert_null(hd_pool_hold(&pool, 1));
}

static void frames_are_read_in_the_order_they_came(void **state)
{
	(void)state;
	for (int i = 0; i < SLOTS; i++)
		assert_true(write_frame());
	assert_int_equal(hd_pool_newest(&pool), SLOTS);
	for (uint64_t seq = 1; seq <= SLOTS; seq++)
		expect_frame(seq);
	assert_null(hd_pool_hold(&pool, SLOTS + 1));
}

static void the_newest_frames_replace_the_oldest(void **state)
{
	(void)state;
	for (int i = 0; i < 3 * SLOTS + 1; i++)
		assert_true(write_frame());
	uint64_t newest = hd_pool_newest(&pool);
	assert_int_equal(newest, 3 * SLOTS + 1);
	for (uint64_t seq = newest - SLOTS + 1; seq <= newest; seq++)
		expect_frame(seq);
	assert_null(hd_pool_hold(&pool, newest - SLOTS));
}

static void a_held_frame_stays_while_the_others_go_round(void **state)
{
	(void)state;
	assert_true(write_frame());
	const struct hd_frame *held = hd_pool_hold(&pool, 1);
	assert_non_null(held);
	for (int i = 0; i < 5 * SLOTS; i++)
		assert_true(write_frame());
	assert_int_equal(held->seq, 1);
	assert_true(frame_is_whole(held));
	expect_frame(hd_pool_newest(&pool));
	hd_pool_release(held);
}

static void the_newest_is_refused_when_all_are_held(void **state)
{
	const struct hd_frame *held[SLOTS];

	(void)state;
	for (uint64_t i = 0; i < SLOTS; i++) {
		assert_true(write_frame());
		held[i] = hd_pool_hold(&pool, i + 1);
		assert_non_null(held[i]);
	}
	assert_false(write_frame());
	assert_int_equal(hd_pool_newest(&pool), SLOTS);
	hd_pool_release(held[2]);
	assert_true(write_frame()); /* numbers go on without a gap */
	assert_int_equal(hd_pool_newest(&pool), SLOTS + 1);
	for (int i = 0; i < SLOTS; i++)
		if (i != 2)
			hd_pool_release(held[i]);
}

static void two_readers_share_a_frame(void **state)
{
	(void)state;
	for (int i = 0; i < SLOTS; i++)
		assert_true(write_frame());
	const struct hd_frame *a = hd_pool_hold(&pool, 1), *b = hd_pool_hold(&pool, 1);
	assert_ptr_equal(a, b);
	hd_pool_release(a);
	assert_true(write_frame()); /* takes another slot: b still holds this one */
	assert_int_equal(b->seq, 1);
	hd_pool_release(b);
}

static void a_frame_gets_its_shot_while_it_is_there(void **state)
{
	(void)state;
	assert_true(write_frame());
	hd_pool_set_shot(&pool, 1, 77);
	const struct hd_frame *frame = hd_pool_hold(&pool, 1);
	assert_int_equal(atomic_load(&frame->shot), 77);
	hd_pool_release(frame);
	hd_pool_set_shot(&pool, 2, 78); /* not there: nothing happens */
}

static void pools_without_slots_or_with_too_many_are_refused(void **state)
{
	struct hd_pool bad;

	(void)state;
	assert_int_equal(hd_pool_init(&bad, 0, BYTES), -EINVAL);
	assert_int_equal(hd_pool_init(&bad, HD_POOL_SLOTS_MAX + 1, BYTES), -EINVAL);
	assert_int_equal(hd_pool_init(&bad, 1, 0), -EINVAL);
}

#define RACE_READS 2000

static _Atomic uint64_t reads_whole, reads_torn;
static _Atomic bool race_over;

/* Until the readers have had their share, whoever gets the processor. */
static void *write_many(void *refused)
{
	while (atomic_load(&reads_whole) + atomic_load(&reads_torn) < RACE_READS)
		*(uint64_t *)refused += !write_frame();
	atomic_store(&race_over, true);
	return NULL;
}

static void *read_many(void *argument)
{
	(void)argument;
	while (!atomic_load(&race_over)) {
		const struct hd_frame *frame = hd_pool_hold(&pool, hd_pool_newest(&pool));

		if (!frame)
			continue;
		atomic_fetch_add(frame_is_whole(frame) ? &reads_whole : &reads_torn, 1);
		hd_pool_release(frame);
	}
	return NULL;
}

static void no_reader_sees_a_torn_frame(void **state)
{
	uint64_t refused = 0;
	pthread_t writer, readers[2];

	(void)state;
	for (int i = 0; i < 2; i++)
		assert_int_equal(pthread_create(&readers[i], NULL, read_many, NULL), 0);
	assert_int_equal(pthread_create(&writer, NULL, write_many, &refused), 0);
	pthread_join(writer, NULL);
	for (int i = 0; i < 2; i++)
		pthread_join(readers[i], NULL);
	assert_int_equal(atomic_load(&reads_torn), 0);
	assert_int_equal(refused, 0); /* two readers cannot hold four slots */
}

#define POOL_TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		POOL_TEST(an_empty_pool_has_no_newest_frame),
		POOL_TEST(frames_are_read_in_the_order_they_came),
		POOL_TEST(the_newest_frames_replace_the_oldest),
		POOL_TEST(a_held_frame_stays_while_the_others_go_round),
		POOL_TEST(the_newest_is_refused_when_all_are_held),
		POOL_TEST(two_readers_share_a_frame),
		POOL_TEST(a_frame_gets_its_shot_while_it_is_there),
		cmocka_unit_test(pools_without_slots_or_with_too_many_are_refused),
		POOL_TEST(no_reader_sees_a_torn_frame),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
