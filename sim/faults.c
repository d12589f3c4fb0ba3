/*
 * Pure: the same list and time give the same faults.
 */
#include "sim/faults.h"

#include <string.h>

#include "base/clock.h"

static int64_t ns_of(double time_s)
{
	return (int64_t)(time_s * (double)NS_PER_S);
}

static bool is_on(const struct sim_fault *fault, const char *device, int64_t time_ns)
{
	int64_t since_ns = time_ns - ns_of(fault->at_s);

	return strcmp(fault->device, device) == 0 && since_ns >= 0 &&
	       (fault->for_s <= 0 || since_ns < ns_of(fault->for_s));
}

sim_fault_mask sim_faults_of(const struct sim_faults *faults, const char *device, int64_t time_ns,
			     int64_t period_ns)
{
	sim_fault_mask mask = 0;

	for (uint32_t i = 0; faults && i < faults->count; i++) {
		const struct sim_fault *fault = &faults->faults[i];

		if (is_on(fault, device, time_ns) &&
		    (time_ns - ns_of(fault->at_s)) / period_ns % fault->every == 0)
			mask |= SIM_FAULT_BIT(fault->kind);
	}
	return mask;
}

/* The first one of that kind at that time; NULL without. */
static const struct sim_fault *find_fault(const struct sim_faults *faults, const char *device,
					  enum sim_fault_kind kind, int64_t time_ns)
{
	for (uint32_t i = 0; faults && i < faults->count; i++)
		if (faults->faults[i].kind == (int)kind &&
		    is_on(&faults->faults[i], device, time_ns))
			return &faults->faults[i];
	return NULL;
}

static int64_t ns_of_ms(double time_ms)
{
	return (int64_t)(time_ms * (double)NS_PER_MS);
}

int64_t sim_faults_delay_ns(const struct sim_faults *faults, const char *device, int64_t time_ns)
{
	const struct sim_fault *fault = find_fault(faults, device, SIM_FAULT_DELAY, time_ns);

	return fault ? ns_of_ms(fault->delay_ms) : 0;
}

int64_t sim_faults_clock_off_ns(const struct sim_faults *faults, const char *device,
				int64_t time_ns)
{
	const struct sim_fault *fault = find_fault(faults, device, SIM_FAULT_CLOCK_STEP, time_ns);

	return fault ? ns_of_ms(fault->step_ms) : 0;
}

bool sim_faults_was_unplugged(const struct sim_faults *faults, const char *device, int64_t time_ns)
{
	for (uint32_t i = 0; faults && i < faults->count; i++)
		if (faults->faults[i].kind == SIM_FAULT_UNPLUG &&
		    strcmp(faults->faults[i].device, device) == 0 &&
		    time_ns >= ns_of(faults->faults[i].at_s))
			return true;
	return false;
}
