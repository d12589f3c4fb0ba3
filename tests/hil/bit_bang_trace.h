/*
 * What an emulated adapter wrote down (bit_bang.h), for tests. Failing is cmocka's.
 */
#pragma once

#include "tests/hil/bit_bang.h"

#define BIT_BANG_RECORDS_MAX 20000

struct bit_bang_trace {
	struct bit_bang_record records[BIT_BANG_RECORDS_MAX];
	int count;
};

/* Of one line. */
struct bit_bang_pulse {
	int64_t begin, end; /* samples */
	int64_t begin_ns;
};

void bit_bang_trace_read(struct bit_bang_trace *trace, const char *path);

/* All pulses of a line; the last is over. Returns how many. */
int bit_bang_trace_pulses(const struct bit_bang_trace *trace, uint32_t bit,
			  struct bit_bang_pulse *out, int max);

const struct bit_bang_record *bit_bang_trace_last_change(const struct bit_bang_trace *trace);
int bit_bang_trace_count(const struct bit_bang_trace *trace, enum bit_bang_kind kind);

/* How often it had no samples between these times. */
int bit_bang_trace_gaps(const struct bit_bang_trace *trace, int64_t from_ns, int64_t to_ns);

void bit_bang_trace_print_gaps(const struct bit_bang_trace *trace, int64_t now_ns);
