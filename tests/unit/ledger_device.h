/*
 * A camera whose frames of known shots are put before a ledger. Behind cmocka.h.
 */
#pragma once

#include <stdint.h>

#include "track/sync/ledger.h"

#define MS INT64_C(1000000)
#define PERIOD_NS INT64_C(8333333)
#define FIRST_SHOT 1000
#define ARRIVAL_NS (3 * MS)

static struct ledger ledger;

/* One camera's device: what it counts and how it stamps. */
struct device {
	uint32_t camera;
	uint64_t seq;
	int64_t stamp_off_ns;
	int64_t late_ns;
};

static inline int64_t time_of(uint64_t shot)
{
	return 50 * MS + (int64_t)(shot - FIRST_SHOT) * PERIOD_NS;
}

static inline void start(void)
{
	ledger_init(&ledger, PERIOD_NS);
	for (uint64_t shot = FIRST_SHOT; shot < FIRST_SHOT + 250; shot++)
		assert_true(edges_add(&ledger.edges, shot, 0, time_of(shot)));
}

/* Its next frame, exposed on `shot`. The shot that the ledger says it is, or 0 when refused. */
static inline uint64_t take(struct device *device, uint64_t shot)
{
	struct ledger_frame frame = {.device_seq = device->seq++,
				     .mid_exposure_ns = time_of(shot) + device->stamp_off_ns,
				     .arrival_ns = time_of(shot) + ARRIVAL_NS + device->late_ns};
	uint64_t found = 0;
	int64_t mid_exposure_ns = 0;
	enum ledger_verdict verdict =
		ledger_judge(&ledger, device->camera, &frame, true, &found, &mid_exposure_ns);

	if (verdict != LEDGER_TAKE)
		return 0;
	assert_in_range(mid_exposure_ns - time_of(found) + MS, 0, 2 * MS);
	return found;
}

static inline uint64_t count(enum ledger_event event)
{
	return ledger.cameras[0].counts[event];
}

/* Frames of shots `from` to `to` that are all taken for what they are. */
static inline void run(struct device *device, uint64_t from, uint64_t to)
{
	for (uint64_t shot = from; shot <= to; shot++)
		assert_int_equal(take(device, shot), shot);
}

/* All events but those of `mask` have not happened. */
static inline void expect_only(uint32_t mask)
{
	for (int e = 0; e < LEDGER_EVENT_COUNT; e++)
		if (!(mask >> e & 1) && count((enum ledger_event)e))
			fail_msg("%s happened", ledger_event_name((enum ledger_event)e));
		else if ((mask >> e & 1) && !count((enum ledger_event)e))
			fail_msg("%s did not happen", ledger_event_name((enum ledger_event)e));
}

#define ONLY(event) (1u << (event))
