/*
 * Simulated cameras with faults, through the station's own threads: every picture carries its true
 * shot as a row of spots, and in the tracker's place a clerk compares it with the shot that it was
 * paired into. Nothing is paired wrongly, and every fault has its name in the right camera's
 * counts.
 */
#include "virtual_station.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock_virtual.h"
#include "sim/render/render.h"
#include "sim/world/world.h"
#include "track/tracker.h"

#define WIDTH_PX 1280
#define HEIGHT_PX 1024
#define BITS 16
#define PITCH_PX 60
#define CODE_Y_PX 100
#define SIGN_Y_PX 300 /* a row of spots in every picture, so that a lit camera sees many */

static _Atomic uint64_t paired, mispaired;

/* In the place of sim/render/render.c. */
struct sim_renderer {
	uint8_t pixels[WIDTH_PX * HEIGHT_PX];
};

int sim_renderer_create(struct sim_renderer **out, const struct sim_scene *scene, uint32_t camera,
			enum sim_noise noise)
{
	(void)scene, (void)camera, (void)noise;
	*out = calloc(1, sizeof(**out));
	return *out ? 0 : -1;
}

void sim_renderer_destroy(struct sim_renderer *renderer)
{
	free(renderer);
}

static void draw_spot(struct sim_renderer *renderer, int bit, int y_px, uint8_t value)
{
	for (int y = 0; y < 5; y++)
		memset(&renderer->pixels[(y_px + y) * WIDTH_PX + PITCH_PX * (bit + 1)], value, 5);
}

const uint8_t *sim_render(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			  int *height_px)
{
	for (int bit = 0; bit < BITS; bit++) {
		draw_spot(renderer, bit, CODE_Y_PX, shot >> bit & 1 ? 200 : 0);
		draw_spot(renderer, bit, SIGN_Y_PX, 200);
	}
	*width_px = WIDTH_PX;
	*height_px = HEIGHT_PX;
	return renderer->pixels;
}

const uint8_t *sim_render_unlit(struct sim_renderer *renderer, uint64_t shot, int *width_px,
				int *height_px)
{
	(void)shot;
	memset(renderer->pixels, 0, sizeof(renderer->pixels));
	*width_px = WIDTH_PX;
	*height_px = HEIGHT_PX;
	return renderer->pixels;
}

const uint8_t *sim_render_dark(struct sim_renderer *renderer, uint64_t shot, int *width_px,
			       int *height_px)
{
	return sim_render_unlit(renderer, shot, width_px, height_px);
}

/* In the place of track/tracker.c. */
struct tracker_settings tracker_settings_default(void)
{
	return (struct tracker_settings){.match_gate_px = 1, .range_min_m = 0.1, .range_max_m = 20};
}

int tracker_scratch_create(struct tracker_scratch **out)
{
	*out = NULL;
	return 0;
}

void tracker_scratch_destroy(struct tracker_scratch *scratch)
{
	(void)scratch;
}

void tracker_state_init(struct tracker_state *state, const struct layout *layout)
{
	(void)layout;
	memset(state, 0, sizeof(*state));
}

static bool read_code(const struct blob_set *set, uint64_t *shot)
{
	int signs = 0;

	*shot = 0;
	for (uint32_t b = 0; b < set->blob_count; b++) {
		int bit = (int)(set->blobs[b].x_px / PITCH_PX) - 1;

		if (set->blobs[b].y_px > SIGN_Y_PX - 50)
			signs++;
		else
			*shot |= UINT64_C(1) << bit;
	}
	return signs == BITS;
}

void tracker_prepare(const struct tracker_state *state, struct tracker_scratch *scratch,
		     const struct tracker_rig *rig)
{
	(void)state, (void)scratch, (void)rig;
}

void tracker_run(struct tracker_state *state, struct tracker_scratch *scratch,
		 const struct tracker_rig *rig, const struct shot *shot, struct marker_set *out)
{
	(void)state, (void)scratch, (void)rig;
	memset(out, 0, sizeof(*out));
	out->shot = shot->number;
	out->camera_count = shot->camera_count;
	out->missing_mask = shot->missing_mask;
	for (uint32_t c = 0; c < shot->camera_count; c++) {
		uint64_t seen;

		if (!shot->sets[c] || !read_code(shot->sets[c], &seen))
			continue;
		atomic_fetch_add(&paired, 1);
		if (seen != (shot->number & ((1 << BITS) - 1)))
			atomic_fetch_add(&mispaired, 1);
	}
}

#define STAGE(faults) "trigger: sim\nsim:\n  faults:\n" faults

/* Runs the faults, which are over after 3.0 s, and returns the station. */
static struct station *run_with(const char *extra_yaml, uint32_t hd_count)
{
	atomic_store(&paired, 0);
	atomic_store(&mispaired, 0);
	struct station *station = virtual_station_start("talking", hd_count, extra_yaml);

	virtual_station_run_to(station, 3.5);
	assert_int_equal(atomic_load(&mispaired), 0);
	assert_true(atomic_load(&paired) > 1200);
	assert_int_equal(atomic_load(&station->solver.lost), 0);
	return station;
}

#define EVENTS(camera, event) virtual_station_events(station, camera, event)

/* Nothing but `mask` was found at a camera. */
static void expect_only(const struct station *station, uint32_t camera, uint32_t mask)
{
	for (int e = 0; e < LEDGER_EVENT_COUNT; e++)
		if (!(mask >> e & 1) && EVENTS(camera, (enum ledger_event)e))
			fail_msg("camera %u: %s", camera, ledger_event_name((enum ledger_event)e));
}

#define ONLY(event) (1u << (event))

static void a_healthy_stage_has_no_events(void **state)
{
	struct station *station = run_with("trigger: sim\n", 1);

	(void)state;
	for (uint32_t c = 0; c < 5; c++)
		expect_only(station, c, 0);
	assert_int_equal(atomic_load(&station->solver.incomplete), 0);
	virtual_station_end(station);
}

static void lost_and_repeated_frames_are_counted_to_the_frame(void **state)
{
	struct station *station =
		run_with(STAGE("  - {camera: ir0, kind: drop, at_s: 1.5, for_s: 0.5, every: 10}\n"
			       "  - {camera: ir1, kind: repeat, at_s: 1.5, for_s: 0.5, every: 10}\n"
			       "  - {camera: ir2, kind: freeze, at_s: 1.5, for_s: 0.5}\n"),
			 0);

	(void)state;
	assert_int_equal(EVENTS(0, LEDGER_DROPPED), 6);
	assert_int_equal(EVENTS(1, LEDGER_REPEATED), 6);
	assert_int_equal(EVENTS(2, LEDGER_MISSED_TRIGGER), 60);
	expect_only(station, 0, ONLY(LEDGER_DROPPED));
	expect_only(station, 1, ONLY(LEDGER_REPEATED));
	expect_only(station, 2, ONLY(LEDGER_MISSED_TRIGGER));
	expect_only(station, 3, 0);
	assert_int_equal(atomic_load(&station->captures[0].counters.missing), 6);
	assert_int_equal(atomic_load(&station->captures[1].counters.missing), 0);
	virtual_station_end(station);
}

static void late_frames_are_refused_and_named(void **state)
{
	struct station *station = run_with(
		STAGE("  - {camera: ir3, kind: delay, at_s: 1.5, for_s: 0.008, delay_ms: 60}\n"),
		0);

	(void)state;
	assert_in_range(EVENTS(3, LEDGER_LATE), 3, 8);
	expect_only(station, 3, ONLY(LEDGER_LATE) | ONLY(LEDGER_DROPPED));
	expect_only(station, 0, 0);
	virtual_station_end(station);
}

static void shifted_stamps_are_put_right(void **state)
{
	struct station *station =
		run_with(STAGE("  - {camera: ir1, kind: stamp_shift, at_s: 1.5, for_s: 0.5}\n"), 0);

	(void)state;
	assert_int_equal(EVENTS(1, LEDGER_SHIFTED), 60);
	expect_only(station, 1, ONLY(LEDGER_SHIFTED));
	assert_int_equal(atomic_load(&station->solver.incomplete), 0);
	virtual_station_end(station);
}

static void a_missed_trigger_is_named_when_the_camera_is_sure_again(void **state)
{
	struct station *station =
		run_with(STAGE("  - {camera: ir2, kind: miss, at_s: 1.5, for_s: 0.008}\n"), 0);

	(void)state;
	assert_int_equal(EVENTS(2, LEDGER_MISSED_TRIGGER), 1);
	assert_int_equal(EVENTS(2, LEDGER_DOUBTFUL), 3);
	expect_only(station, 2, ONLY(LEDGER_MISSED_TRIGGER) | ONLY(LEDGER_DOUBTFUL));
	assert_int_equal(atomic_load(&station->captures[2].counters.missing), 4);
	virtual_station_end(station);
}

static void a_camera_that_misses_every_other_trigger_is_slower(void **state)
{
	struct station *station = run_with(
		STAGE("  - {camera: ir2, kind: miss, at_s: 1.5, for_s: 1.5, every: 2}\n"), 0);

	(void)state;
	assert_int_equal(EVENTS(2, LEDGER_SLOWER_THAN_TRIGGER), 1);
	assert_false(atomic_load(&station->solver.book.cameras[2].slower)); /* over by now */
	expect_only(station, 0, 0);
	virtual_station_end(station);
}

static void an_unplugged_camera_comes_back_with_a_new_counter(void **state)
{
	struct station *station =
		run_with(STAGE("  - {camera: ir0, kind: unplug, at_s: 1.5, for_s: 0.5}\n"), 0);

	(void)state;
	assert_int_equal(atomic_load(&station->captures[0].counters.reopened), 1);
	assert_int_equal(EVENTS(0, LEDGER_RESTARTED), 1);
	expect_only(station, 0, ONLY(LEDGER_RESTARTED));
	assert_in_range(atomic_load(&station->captures[0].counters.missing), 55, 80);
	virtual_station_end(station);
}

static void a_dead_strobe_is_dark(void **state)
{
	struct station *station =
		run_with(STAGE("  - {camera: ir3, kind: dark, at_s: 1.5, for_s: 0.5}\n"), 0);

	(void)state;
	assert_int_equal(EVENTS(3, LEDGER_DARK), 1);
	expect_only(station, 3, ONLY(LEDGER_DARK));
	assert_false(atomic_load(&station->solver.book.cameras[3].dark));
	virtual_station_end(station);
}

static void a_clock_that_steps_is_named_and_put_right(void **state)
{
	struct station *station = run_with(
		STAGE("  - {camera: ir1, kind: clock_step, at_s: 1.5, step_ms: 2.5}\n"
		      "  - {camera: ir2, kind: clock_step, at_s: 1.5, step_ms: 5}\n"
		      "  - {camera: ir3, kind: clock_step, at_s: 1.5, for_s: 1, step_ms: -130}\n"),
		0);

	(void)state;
	assert_int_equal(EVENTS(1, LEDGER_CLOCK_STEPPED), 1);
	assert_int_equal(EVENTS(2, LEDGER_CLOCK_STEPPED), 1);
	assert_int_equal(EVENTS(3, LEDGER_CLOCK_STEPPED), 2); /* there and back */
	expect_only(station, 0, 0);
	expect_only(station, 1, ONLY(LEDGER_CLOCK_STEPPED));
	expect_only(station, 2, ONLY(LEDGER_CLOCK_STEPPED));
	expect_only(station, 3, ONLY(LEDGER_CLOCK_STEPPED) | ONLY(LEDGER_SHIFTED));
	assert_int_equal(atomic_load(&station->solver.incomplete), 0);
	virtual_station_end(station);
}

static void an_hd_phase_that_slips_is_named(void **state)
{
	struct station *station =
		run_with(STAGE("  - {camera: hd0, kind: phase_slip, at_s: 1.5, for_s: 0.5}\n"), 1);

	(void)state;
	assert_in_range(EVENTS(4, LEDGER_PHASE_SLIPPED), 15, 16);
	expect_only(station, 4, ONLY(LEDGER_PHASE_SLIPPED));
	expect_only(station, 0, 0);
	virtual_station_end(station);
}

#define LEFT_OUT_SHOT 180 /* at 1.5 s */
#define REPORTED_AFTER_NS (15 * NS_PER_MS / 2)

/* The simulated trigger, reporting after the frames have come, with a shot left out. */
static int report_late(struct trigger *trigger, int64_t timeout_ns, struct edge *out)
{
	int err = sim_trigger_driver.next(trigger, timeout_ns, out);
	bool left_out = err == 0 && out->shot == LEFT_OUT_SHOT;

	if (left_out)
		err = sim_trigger_driver.next(trigger, timeout_ns, out);
	if (err == 0) {
		out->missed = left_out;
		clock_sleep_until(out->edge_ns + REPORTED_AFTER_NS);
	}
	return err;
}

static void a_shot_left_out_is_no_fault_of_cameras_ahead_of_its_report(void **state)
{
	struct trigger_driver late = sim_trigger_driver;
	struct station *station = virtual_station_configure(
		"talking", 0,
		STAGE("  - {camera: ir0, kind: miss, at_s: 1.5, for_s: 0.008}\n"
		      "  - {camera: ir1, kind: miss, at_s: 1.5, for_s: 0.008}\n"
		      "  - {camera: ir2, kind: miss, at_s: 1.5, for_s: 0.008}\n"
		      "  - {camera: ir3, kind: miss, at_s: 1.5, for_s: 0.008}\n"),
		NULL);

	(void)state;
	late.next = report_late;
	station->pulses.driver = &late;
	atomic_store(&paired, 0);
	atomic_store(&mispaired, 0);
	assert_int_equal(station_start(station, STATION_START, NULL), EXIT_CODE_OK);
	virtual_station_run_to(station, 3.5);
	assert_int_equal(atomic_load(&mispaired), 0);
	assert_true(atomic_load(&paired) > 1200);
	assert_int_equal(atomic_load(&station->solver.lost), 1);
	assert_int_equal(atomic_load(&station->solver.incomplete), 0);
	for (uint32_t c = 0; c < 4; c++)
		expect_only(station, c, 0);
	virtual_station_end(station);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_healthy_stage_has_no_events),
		cmocka_unit_test(lost_and_repeated_frames_are_counted_to_the_frame),
		cmocka_unit_test(late_frames_are_refused_and_named),
		cmocka_unit_test(shifted_stamps_are_put_right),
		cmocka_unit_test(a_missed_trigger_is_named_when_the_camera_is_sure_again),
		cmocka_unit_test(a_camera_that_misses_every_other_trigger_is_slower),
		cmocka_unit_test(an_unplugged_camera_comes_back_with_a_new_counter),
		cmocka_unit_test(a_dead_strobe_is_dark),
		cmocka_unit_test(a_clock_that_steps_is_named_and_put_right),
		cmocka_unit_test(an_hd_phase_that_slips_is_named),
		cmocka_unit_test(a_shot_left_out_is_no_fault_of_cameras_ahead_of_its_report),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
