/*
 * Subscribers are programs outside: they live in real time and may be slow. Time waits for them, so
 * that none loses a set that it would have had in real time.
 */
#include "daemon/virtual_time.h"

#include "base/clock_virtual.h"
#include "daemon/control/varlink.h"

#define START_NS (1000 * NS_PER_S) /* the same in every run */
#define AHEAD_NS (100 * NS_PER_MS) /* of the scene's own begin */
#define ADVANCE_MAX_S 86400.0

void virtual_time_begin(struct virtual_time *virtual_time, const struct config *config)
{
	int64_t start_ns =
		config->sim_epoch_ns > AHEAD_NS ? config->sim_epoch_ns - AHEAD_NS : START_NS;

	*virtual_time = (struct virtual_time){.stepped = config->sim_clock == SIM_CLOCK_STEPPED};
	if (config->sim_clock == SIM_CLOCK_REAL || clock_is_virtual())
		return;
	clock_virtual_begin(start_ns, virtual_time->stepped ? start_ns : CLOCK_NO_LIMIT);
}

void virtual_time_mind_subscribers(struct virtual_time *virtual_time, bool backlog)
{
	bool hold = backlog && !virtual_time->outrun_subscribers;

	if (hold && !virtual_time->holding)
		clock_hold();
	if (!hold && virtual_time->holding)
		clock_release();
	virtual_time->holding = hold;
}

json_t *virtual_time_advance(struct virtual_time *virtual_time, const json_t *parameters)
{
	const json_t *seconds = json_object_get(parameters, "seconds");
	double wanted_s = json_number_value(seconds);

	if (!virtual_time->stepped)
		return varlink_error(
			"org.stage.Control.ClockNotStepped",
			json_pack("{s:s}", "remedy", "start the station with sim.clock: stepped"));
	if (!json_is_number(seconds) || !(wanted_s >= 0 && wanted_s <= ADVANCE_MAX_S))
		return varlink_invalid_parameter("seconds");
	virtual_time->outrun_subscribers =
		json_is_true(json_object_get(parameters, "outrun_subscribers"));
	if (wanted_s > 0)
		clock_virtual_set_limit(clock_virtual_limit() + (int64_t)(wanted_s * NS_PER_S));
	return varlink_result(json_pack("{s:I, s:I, s:b}", "now_ns", (json_int_t)clock_now_ns(),
					"until_ns", (json_int_t)clock_virtual_limit(), "arrived",
					clock_virtual_at_limit()));
}
