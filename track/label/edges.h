/*
 * The trigger's last pulses: which of them still waits for its shot, and which one a time belongs
 * to. Flat and pure.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define EDGE_COUNT_MAX 512 /* a power of two: a second at 500 Hz */

struct pulse {
	uint64_t shot;
	int64_t mid_exposure_ns; /* that this edge asks of the IR cameras */
	uint64_t missed;         /* numbers right before it that nothing was fired for */
};

/* Zero it, then set period_ns. */
struct edges {
	int64_t period_ns;
	uint64_t added;            /* since the start; the last EDGE_COUNT_MAX are kept */
	uint64_t settled;          /* of them, those whose shot is closed */
	uint64_t newest_after_gap; /* shot of the newest with `missed` */
	struct pulse pulses[EDGE_COUNT_MAX];
};

/* `missed`: numbers right before it that nothing was fired for; any others before it were fired,
 * and are not known here. False when it does not follow the last one in number and time; then it is
 * left out. The caller checks edges_full() first. */
bool edges_add(struct edges *edges, uint64_t shot, uint64_t missed, int64_t mid_exposure_ns);

/* So many wait for their shots that another one would push a waiting one out. */
bool edges_full(const struct edges *edges);

/* The oldest whose shot is not closed, or NULL. */
const struct pulse *edges_next(const struct edges *edges);
void edges_settle_next(struct edges *edges);

enum edges_found {
	EDGES_NONE,   /* before the first pulse, or there was none yet */
	EDGES_LATER,  /* nearer to a pulse that is not reported yet */
	EDGES_BEHIND, /* counted on from the newest, or from one whose neighbour was not reported */
	EDGES_KNOWN,
};

/* The shot whose mid-exposure is nearest to `mid_exposure_ns`, unless EDGES_NONE; of EDGES_LATER it
 * is counted in periods. */
enum edges_found edges_nearest(const struct edges *edges, int64_t mid_exposure_ns, uint64_t *shot);

/* The shot of a camera's exposure number `count` after that of `shot`, when it exposes in every
 * `stride`-th number: those that nothing was fired for do not count. */
uint64_t edges_count_on(const struct edges *edges, uint64_t shot, uint64_t count, uint32_t stride);

/* When shot's mid-exposure should be; counted in periods where its edge is not known. */
int64_t edges_time_ns(const struct edges *edges, uint64_t shot);
