/*
 * What a trigger driver is: it fires strobes and exposures by a plan and reports the edge of every
 * shot. list, open, arm, disarm and close run on the control thread; next runs on the trigger
 * thread, which may not allocate, lock or log.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "base/diag.h"

/* All delays count from the shot's edge. */
struct trigger_plan {
	int64_t period_ns;
	int64_t ir_delay_ns, ir_exposure_ns;
	int64_t strobe_delay_ns, strobe_width_ns; /* a width of 0: no strobe */
	double strobe_duty_max;   /* share of the time it may burn; 0: STROBE_DUTY_MAX_DEFAULT */
	int hd_divider, hd_phase; /* HD exposes in shots k with k % divider == phase */
	int64_t hd_delay_ns, hd_exposure_ns;
};

/* What went otherwise than planned in a shot, or was seen since the one before: bits of
 * edge.events. docs/faults.md explains them. */
enum pulse_event {
	PULSE_STROBE_SHORT,   /* lit late: it burnt for less than 9/10 of its time */
	PULSE_STROBE_SKIPPED, /* so late, or so soon after the last burn, that it stayed dark */
	PULSE_GUARD_CUT,      /* the guard set all lines dark: this process stood still */
	PULSE_HD_SKIPPED,     /* so late that HD cameras were not triggered */
	PULSE_INPUT_MISSING,  /* no edge came back on the input line */
	PULSE_INPUT_DOUBLED,  /* an edge too many on it */
	PULSE_INPUT_JITTER,   /* an edge there that came at an unusual time */
	PULSE_UNDERRUN,       /* the adapter ran out of samples: its lines stood still, dark */
	PULSE_EVENT_COUNT
};

const char *pulse_event_name(enum pulse_event event); /* "strobe_short", ...; as in status */

struct edge {
	uint64_t shot;          /* one more than the last one's, and `missed` */
	int64_t edge_ns;        /* CLOCK_MONOTONIC; what the middle of the light counts from */
	int64_t uncertainty_ns; /* bound on its error */
	int64_t late_ns;        /* when the pulse was fired, after it should have been */
	uint32_t missed;        /* periods right before this shot in which nothing was fired */
	uint32_t events;        /* bits of enum pulse_event */
};

/* A device that can fire a stage. */
struct trigger_info {
	char address[128]; /* driver:rest, to which the config adds lines */
	char device[160];  /* what it is, and what keeps it from being used */
	char lines[600];   /* that can be wired, as far as there is room; "" when nobody can tell */
};

typedef void trigger_found_fn(const struct trigger_info *info, void *user);

/* What an address has a trigger fire: bits of trigger_driver.fires(). */
enum trigger_fires {
	TRIGGER_FIRES_IR = 1 << 0, /* exposes the IR cameras: they wait for its edges */
	TRIGGER_FIRES_STROBE = 1 << 1,
	TRIGGER_FIRES_HD = 1 << 2, /* triggers the HD cameras */
};

struct trigger_driver;

struct trigger {
	const struct trigger_driver *driver;
};

struct trigger_driver {
	const char *name;
	bool reports_edges; /* false: shots are made from the frames' own times (free running) */

	/* Calls `found` for every device it can see now, also one that may not be opened. Returns 0
	 * or a negative errno with a message. NULL: it has no devices. */
	int (*list)(trigger_found_fn *found, void *user, struct diag *diag);

	/* Whether an address reads as one and a plan is one that such a device can do, without
	 * touching it: 0, or -EINVAL with a message. Without a plan: the address alone. NULL: any
	 * is. */
	int (*check)(const char *rest, const struct trigger_plan *plan, struct diag *diag);

	/* Bits of enum trigger_fires, its usual lines among them where the address names none; 0
	 * for an address that does not read. NULL: it fires no device. */
	uint32_t (*fires)(const char *rest);

	int (*open)(struct trigger **out, const char *rest, struct diag *diag);
	void (*close)(struct trigger *trigger); /* accepts NULL */

	/* Refuses (-EINVAL, with the reason) a plan that cannot be or that would overheat a strobe:
	 * what trigger_plan_check() says, and what the device itself cannot do. */
	int (*arm)(struct trigger *trigger, const struct trigger_plan *plan, struct diag *diag);
	void (*disarm)(struct trigger *trigger); /* all lines dark when it returns */

	/* Waits for the next edge: 0, -ETIMEDOUT, or another error when the device is gone for
	 * good: then it is closed and opened again. HD cameras are
	 * fired in shots k with k % hd_divider == hd_phase. */
	int (*next)(struct trigger *trigger, int64_t timeout_ns, struct edge *out);
};

const struct trigger_driver *trigger_driver_find(const struct trigger_driver *const *drivers,
						 const char *address, const char **rest,
						 struct diag *diag);

/* What the trigger of an address fires: bits of enum trigger_fires, 0 when there is none of its
 * name. */
uint32_t trigger_fires(const struct trigger_driver *const *drivers, const char *address);
