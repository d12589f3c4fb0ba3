/*
 * The states of the station: every pair of state and event, and what may never be.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "daemon/station_states.h"

#define NO STATION_STATE_COUNT /* refused */

static enum station_state next(enum station_state from, enum station_event event)
{
	enum station_state to = NO;

	return station_next_state(from, event, &to) ? to : NO;
}

static void every_event_leads_where_the_design_says(void **state)
{
	/* configure, start, calibrate, over, stop, close */
	static const enum station_state wanted[STATION_STATE_COUNT][STATION_EVENT_COUNT] = {
		[STATION_IDLE] = {STATION_CONFIGURED, NO, NO, NO, NO, NO},
		[STATION_CONFIGURED] = {NO, STATION_RUNNING, STATION_CALIBRATING, NO, NO,
					STATION_IDLE},
		[STATION_RUNNING] = {NO, NO, NO, STATION_ENDED, STATION_CONFIGURED, NO},
		[STATION_CALIBRATING] = {NO, NO, NO, STATION_ENDED, STATION_CONFIGURED, NO},
		[STATION_ENDED] = {NO, NO, NO, NO, STATION_CONFIGURED, NO},
	};

	(void)state;
	for (int s = 0; s < STATION_STATE_COUNT; s++)
		for (int e = 0; e < STATION_EVENT_COUNT; e++)
			assert_int_equal(next((enum station_state)s, (enum station_event)e),
					 wanted[s][e]);
}

static void nothing_is_reconfigured_or_closed_while_it_captures(void **state)
{
	(void)state;
	for (int s = 0; s < STATION_STATE_COUNT; s++)
		if (station_state_captures((enum station_state)s)) {
			assert_int_equal(next((enum station_state)s, STATION_CONFIGURE), NO);
			assert_int_equal(next((enum station_state)s, STATION_CLOSE), NO);
		}
}

static void stop_leaves_every_state_that_captures(void **state)
{
	(void)state;
	for (int s = 0; s < STATION_STATE_COUNT; s++)
		assert_int_equal(next((enum station_state)s, STATION_STOP) == STATION_CONFIGURED,
				 station_state_captures((enum station_state)s));
}

static void every_state_has_a_name_of_its_own(void **state)
{
	(void)state;
	for (int a = 0; a < STATION_STATE_COUNT; a++)
		for (int b = 0; b < a; b++)
			assert_string_not_equal(station_state_name((enum station_state)a),
						station_state_name((enum station_state)b));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_event_leads_where_the_design_says),
		cmocka_unit_test(nothing_is_reconfigured_or_closed_while_it_captures),
		cmocka_unit_test(stop_leaves_every_state_that_captures),
		cmocka_unit_test(every_state_has_a_name_of_its_own),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
