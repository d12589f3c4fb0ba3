/*
 * The phases of shot after shot: which lines are to be lit when, what became of them, and what that
 * makes the time of the shot. Pure: times come in, lines and edges come out. A pulse that is late
 * is shortened or left out, never lengthened; a strobe never burns for more than its share of the
 * time; a shot that would be too late is missed, by number, and the next one is on the grid again.
 */
#pragma once

#include "drivers/trigger.h"

enum pulse_line { PULSE_IR, PULSE_STROBE, PULSE_HD, PULSE_LINE_COUNT };
#define PULSE_BIT(line) (UINT32_C(1) << (line))

#define PULSE_LATE_SHARE 8 /* of a period: what is later is missed */
#define PULSE_NEVER INT64_MAX

/* How a train is set up besides the plan. */
struct pulse_source {
	bool paced_by_input;    /* each shot begins with pulse_train_pace() */
	bool reports_exposure;  /* pulse_train_exposed() tells when a camera opened */
	uint32_t wired;         /* PULSE_BITs of the lines that there are */
	int64_t uncertainty_ns; /* of the input's times */
};

struct pulse {
	bool planned;
	int64_t on_ns, off_ns;
};

struct pulse_train {
	/* set by pulse_train_begin() */
	struct trigger_plan plan;
	struct pulse_source source;

	/* the thread that steps */
	uint64_t next_shot;
	int64_t next_ns; /* its edge, or PULSE_NEVER */
	int64_t paced_ns;
	bool paced_any;
	uint32_t missed;  /* since the last shot that was fired */
	uint32_t strange; /* events since then */
	uint32_t lit;     /* PULSE_BITs, as pulse_train_done() was told */
	struct pulse pulses[PULSE_LINE_COUNT];
	double credit_ns; /* that the strobe may burn */
	int64_t credit_at_ns;

	/* the shot under way */
	bool under_way;
	struct edge made;
	int64_t report_ns;                /* PULSE_NEVER: it is not over */
	int64_t base_ns;                  /* its edge, as planned or as the input told */
	int64_t opened_ns, opened_off_ns; /* of the exposure, and the bound on that error */
	int64_t lit_ns, dark_ns, lit_off_ns, lit_from_ns; /* of the strobe */
	bool fired, burnt, exposed;
	int64_t exposed_ns;    /* as the input told */
	int64_t input_mean_ns; /* usual time from pulse to exposure */
	uint32_t input_count;
};

/* Shot 0 is a period after `now_ns`, or with the input's first edge. `plan` was checked. */
void pulse_train_begin(struct pulse_train *train, const struct trigger_plan *plan,
		       const struct pulse_source *source, int64_t now_ns);

/* When there is something to do; PULSE_NEVER: it waits for the input. */
int64_t pulse_train_due_ns(const struct pulse_train *train);

/* PULSE_BITs that are to be lit now. The caller sets the lines and calls done with the times before
 * and after that. */
uint32_t pulse_train_step(struct pulse_train *train, int64_t now_ns);
void pulse_train_done(struct pulse_train *train, uint32_t lit, int64_t before_ns, int64_t after_ns);

/* True, with `out`, when a shot is over. */
bool pulse_train_report(struct pulse_train *train, int64_t now_ns, struct edge *out);

/* Something strange about the shot under way, or before the next. */
void pulse_train_note(struct pulse_train *train, enum pulse_event event);

/* Edges of the input. */
void pulse_train_pace(struct pulse_train *train, int64_t edge_ns);
void pulse_train_exposed(struct pulse_train *train, int64_t edge_ns);
