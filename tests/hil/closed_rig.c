/*
 * The whole rig on devices of the kernel: closed_rig BUILD DEVICE DIR [usb]. The station triggers
 * through GPIO lines, or through an emulated USB adapter that is wired to them; two emulated USB
 * cameras expose on their pulses, and what arrives at a subscriber is held against the kernel's
 * trace of the lines.
 */
#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/clock.h"
#include "tests/hil/gpio_sim.h"
#include "tests/hil/line_watch.h"
#include "tests/hil/rig_programs.h"

#define SHOTS_MAX 200
#define PERIOD_NS (200 * NS_PER_MS)
#define MIDDLE_NS (30 * NS_PER_MS) /* of the plan's exposure, behind its pulse */
#define PULSES_MAX 1000
#define KILLS_MAX 5 /* until one is in mid-pulse: the station goes dark when it is told so */

enum { IR_LINE, STROBE_LINE };

static struct rig_programs rig;

/* How long to look, and what is to go wrong meanwhile. */
static struct trial {
	uint32_t shots;
	uint32_t complete_min; /* a fault costs its neighbours */
	int damaged_exposure;  /* of camera 0 */
	int lost_exposure;     /* of camera 1 */
	bool goes_on;          /* the trigger has pulses of its own left when the station dies */
} trial = {200, 180, 60, 120, false};

static const struct trial usb_trial = {40, 30, 12, 22, true};

struct seen {
	uint32_t count, complete;
	struct {
		uint64_t shot;
		int64_t mid_exposure_ns;
		uint32_t missing_mask;
	} sets[SHOTS_MAX];
	uint64_t damaged[2], missed[2]; /* of each camera, as the station counts them */
	uint64_t underruns;             /* of the adapter */
};

static uint64_t count_of(const struct stage_count *counts, uint32_t count, const char *cause)
{
	for (uint32_t i = 0; i < count; i++)
		if (strcmp(counts[i].cause, cause) == 0)
			return counts[i].count;
	return 0;
}

static void note_statistics(struct seen *seen, const struct stage_statistics *statistics)
{
	const struct stage_pulses *pulses = statistics->pulses;

	seen->underruns = pulses ? count_of(pulses->events, pulses->event_count, "underrun") : 0;
	for (uint32_t c = 0; c < 2 && c < statistics->camera_count; c++) {
		const struct stage_camera_statistics *camera = &statistics->cameras[c];

		seen->damaged[c] = count_of(camera->losses, camera->loss_count, "damaged") +
				   count_of(camera->events, camera->event_count, "dropped");
		seen->missed[c] = count_of(camera->events, camera->event_count, "missed_trigger");
	}
}

static void note_set(struct seen *seen, const struct stage_marker_set *set)
{
	if (seen->count == trial.shots)
		return;
	seen->sets[seen->count].shot = set->shot;
	seen->sets[seen->count].mid_exposure_ns = set->mid_exposure_ns;
	seen->sets[seen->count].missing_mask = set->missing_mask;
	seen->count++;
	seen->complete += set->missing_mask == 0;
}

static void capture(struct seen *seen)
{
	struct stage_event event;

	*seen = (struct seen){0};
	while (seen->count < trial.shots) {
		assert_int_equal(rig_next_event(&rig, &event), 0);
		if (event.kind == STAGE_MARKERS)
			note_set(seen, event.markers);
	}
}

/* Until `count` sets in a row have both cameras: what was doubtful is decided. */
static void await_complete(uint32_t count)
{
	int64_t until_ns = clock_now_ns() + 60 * NS_PER_S;
	struct stage_event event;
	uint32_t row = 0;

	while (row < count) {
		assert_true(clock_now_ns() < until_ns);
		assert_int_equal(rig_next_event(&rig, &event), 0);
		if (event.kind == STAGE_MARKERS)
			row = event.markers->missing_mask ? 0 : row + 1;
	}
}

static void read_statistics(struct seen *seen)
{
	struct stage_event event;

	do
		assert_int_equal(rig_next_event(&rig, &event), 0);
	while (event.kind != STAGE_STATISTICS);
	note_statistics(seen, event.statistics);
}

/* When the line rose, for every time until now. */
static int read_rises(struct line_watch *watch, int64_t rises_ns[PULSES_MAX])
{
	int64_t until_ns = clock_now_ns();
	struct line_change change = {0};
	int count = 0;

	for (bool lit = false; change.time_ns < until_ns; lit = change.level) {
		assert_int_equal(line_watch_next(watch, 10000, &change), 0);
		if (change.level && !lit && count < PULSES_MAX)
			rises_ns[count++] = change.time_ns;
	}
	return count;
}

/* The set of the shot that this pulse fired, or -1. A trigger thread that was held up right behind
 * its pulse tells it late: the nearest set is the pulse's own, as long as no other pulse has it. */
static int set_of_pulse(const struct seen *seen, int64_t rise_ns)
{
	int64_t nearest_ns = PERIOD_NS;
	int found = -1;

	for (uint32_t i = 0; i < seen->count; i++) {
		int64_t away_ns = llabs(seen->sets[i].mid_exposure_ns - rise_ns - MIDDLE_NS);

		if (away_ns < nearest_ns) {
			nearest_ns = away_ns;
			found = (int)i;
		}
	}
	return found;
}

static bool has_pulse(const int64_t *rises_ns, int rises, int64_t mid_exposure_ns)
{
	for (int i = 0; i < rises; i++)
		if (llabs(mid_exposure_ns - rises_ns[i] - MIDDLE_NS) < PERIOD_NS)
			return true;
	return false;
}

/* Of those since the subscriber was there. */
static int pulses_without_a_set(const struct seen *seen, const int64_t *rises_ns, int rises)
{
	int64_t begin_ns = seen->sets[0].mid_exposure_ns;
	int64_t end_ns = seen->sets[seen->count - 1].mid_exposure_ns - PERIOD_NS;
	int count = 0, last = -1;

	for (int i = 0; i < rises; i++) {
		bool again = i > 0 && rises_ns[i] < rises_ns[i - 1] + PERIOD_NS / 2; /* cut */
		int set = set_of_pulse(seen, rises_ns[i]);

		if (rises_ns[i] <= begin_ns || rises_ns[i] >= end_ns || again)
			continue;
		if (set > last) {
			last = set;
			continue;
		}
		uint32_t s = 0;

		while (seen->sets[s].mid_exposure_ns < rises_ns[i])
			s++;
		print_message("# pulse %d has no shot: %.1f ms after shot %d, %.1f before %d\n", i,
			      (double)(rises_ns[i] - seen->sets[s - 1].mid_exposure_ns) / NS_PER_MS,
			      (int)seen->sets[s - 1].shot,
			      (double)(seen->sets[s].mid_exposure_ns - rises_ns[i]) / NS_PER_MS,
			      (int)seen->sets[s].shot);
		count++;
	}
	return count;
}

/* Every pulse since the subscriber was there is a shot, and no shot that a camera saw is without a
 * pulse. */
static void check_shots(const struct seen *seen, const int64_t *rises_ns, int rises)
{
	assert_int_equal(pulses_without_a_set(seen, rises_ns, rises), 0);
	for (uint32_t i = 0; i < seen->count; i++) {
		assert_int_equal(i > 0 && seen->sets[i].shot <= seen->sets[i - 1].shot, 0);
		if (seen->sets[i].missing_mask != 3)
			assert_true(has_pulse(rises_ns, rises, seen->sets[i].mid_exposure_ns));
	}
}

/* The first exposures of a camera are the first pulses. A frame cut short is dropped by some
 * kernels and handed over as damaged by others. */
static void check_faults(const struct seen *seen, const int64_t *rises_ns)
{
	int damaged = set_of_pulse(seen, rises_ns[trial.damaged_exposure]);
	int lost = set_of_pulse(seen, rises_ns[trial.lost_exposure]);

	print_message("# pulse %d is shot %d, pulse %d is shot %d\n", trial.damaged_exposure,
		      damaged < 0 ? -1 : (int)seen->sets[damaged].shot, trial.lost_exposure,
		      lost < 0 ? -1 : (int)seen->sets[lost].shot);
	assert_true(seen->damaged[0] >= 1);
	assert_true(seen->missed[1] >= 1);
	assert_true(damaged >= 0 && seen->sets[damaged].missing_mask & 1);
	assert_true(lost >= 0 && seen->sets[lost].missing_mask & 2);
}

static void every_pulse_is_a_shot_and_lost_frames_are_named(void **state)
{
	static int64_t rises_ns[PULSES_MAX];
	static struct seen seen;
	char damaged[12], lost[12];
	struct line_watch watch;

	(void)state;
	snprintf(damaged, sizeof(damaged), "%d", trial.damaged_exposure);
	snprintf(lost, sizeof(lost), "%d", trial.lost_exposure);
	assert_int_equal(line_watch_open(&watch, rig.device, IR_LINE), 0);
	rig_plug_in(&rig, 0, "--damage", damaged);
	rig_plug_in(&rig, 1, "--lose", lost);
	rig_start_station(&rig);
	capture(&seen);
	int rises = read_rises(&watch, rises_ns);

	line_watch_close(&watch);
	await_complete(5);
	read_statistics(&seen);
	print_message("# %u of %u shots complete; %d and %d damaged, %d and %d missed; "
		      "%d underruns\n",
		      seen.complete, seen.count, (int)seen.damaged[0], (int)seen.damaged[1],
		      (int)seen.missed[0], (int)seen.missed[1], (int)seen.underruns);
	for (uint32_t i = 0; i < seen.count; i++)
		if (seen.sets[i].missing_mask)
			print_message("# shot %d: missing %x\n", (int)seen.sets[i].shot,
				      seen.sets[i].missing_mask);
	assert_int_equal(seen.underruns, 0);
	assert_true(seen.complete >= trial.complete_min);
	check_shots(&seen, rises_ns, rises);
	check_faults(&seen, rises_ns);
}

static void unplugged_camera_comes_back_by_its_serial_number(void **state)
{
	struct stage_event event;

	(void)state;
	rig_kill(&rig.cameras[0], SIGKILL);
	do
		assert_int_equal(rig_next_event(&rig, &event), 0);
	while (event.kind != STAGE_MARKERS || !(event.markers->missing_mask & 1));
	rig_plug_in(&rig, 0, NULL, NULL);
	await_complete(10);
}

/* Kills the station with the strobe lit. Returns how long that stayed so, or 0 when it went dark
 * before the station died. */
static int64_t kill_in_mid_pulse(struct line_watch *watch)
{
	struct line_change change;
	int64_t killed_ns;

	do
		assert_int_equal(line_watch_next(watch, 10000, &change), 0);
	while (!change.level || change.time_ns < clock_now_ns() - PERIOD_NS / 10);
	killed_ns = clock_now_ns();
	rig_kill(&rig.station, SIGKILL);
	assert_int_equal(line_watch_next(watch, 10000, &change), 0);
	assert_false(change.level);
	return change.time_ns > killed_ns ? change.time_ns - killed_ns : 0;
}

/* Whatever is still said to the line is said soon; then nothing is. An adapter may have whole
 * pulses left, until the kernel has taken what is on its way from the dead station. */
static void check_stays_dark(struct line_watch *watch, int64_t dead_ns)
{
	struct line_change change;

	while (line_watch_next(watch, 2000, &change) == 0) {
		assert_true(trial.goes_on || !change.level);
		assert_true(change.time_ns < dead_ns + NS_PER_S);
	}
	assert_int_equal(gpio_sim_level(rig.device, STROBE_LINE), 0);
}

static void strobe_of_a_station_killed_in_mid_pulse_is_dark_within_a_period(void **state)
{
	struct line_watch watch;
	int64_t burnt_ns = 0;

	(void)state;
	for (int i = 0; i < KILLS_MAX && burnt_ns == 0; i++) {
		if (!rig.station)
			rig_start_station(&rig);
		assert_int_equal(line_watch_open(&watch, rig.device, STROBE_LINE), 0);
		burnt_ns = kill_in_mid_pulse(&watch);
		print_message("# dark %.1f ms after the kill\n", (double)burnt_ns / NS_PER_MS);
		check_stays_dark(&watch, clock_now_ns());
		line_watch_close(&watch);
		stage_client_close(rig.client);
		rig.client = NULL;
	}
	assert_true(burnt_ns > 0);
	assert_true(burnt_ns < PERIOD_NS);
}

static void station_started_after_a_kill_goes_on(void **state)
{
	(void)state;
	rig_start_station(&rig);
	await_complete(10);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_pulse_is_a_shot_and_lost_frames_are_named),
		cmocka_unit_test(unplugged_camera_comes_back_by_its_serial_number),
		cmocka_unit_test(strobe_of_a_station_killed_in_mid_pulse_is_dark_within_a_period),
		cmocka_unit_test(station_started_after_a_kill_goes_on),
	};
	const struct CMUnitTest usb_tests[] = {tests[0], tests[2], tests[3]}; /* the rest is said */

	if (argc < 4 || argc > 5 || (argc == 5 && strcmp(argv[4], "usb") != 0)) {
		fprintf(stderr, "usage: %s BUILD DEVICE DIR [usb]\n", argv[0]);
		return EXIT_FAILURE;
	}
	if (argc == 5)
		trial = usb_trial;
	rig = (struct rig_programs){.build = argv[1], .device = argv[2], .dir = argv[3]};
	cmocka_set_message_output(CM_OUTPUT_TAP);
	int failed = trial.goes_on ? cmocka_run_group_tests(usb_tests, NULL, NULL)
				   : cmocka_run_group_tests(tests, NULL, NULL);

	rig_end(&rig);
	return failed;
}
