/*
 * Reads the trace of an emulated adapter.
 */
#include "tests/hil/bit_bang_trace.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"

void bit_bang_trace_read(struct bit_bang_trace *trace, const char *path)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC);

	assert_true(fd >= 0);
	trace->count = (int)(read(fd, trace->records, sizeof(trace->records)) /
			     (ssize_t)sizeof(trace->records[0]));
	close(fd);
	assert_in_range(trace->count, 1, BIT_BANG_RECORDS_MAX - 1);
}

int bit_bang_trace_pulses(const struct bit_bang_trace *trace, uint32_t bit,
			  struct bit_bang_pulse *out, int max)
{
	uint32_t was = 0;
	int count = 0;

	for (int r = 0; r < trace->count; r++) {
		const struct bit_bang_record *record = &trace->records[r];

		if (record->kind != BIT_BANG_LINES)
			continue;
		assert_true(count < max);
		if (record->levels & bit & ~was)
			out[count] = (struct bit_bang_pulse){.begin = record->sample,
							     .begin_ns = record->time_ns};
		if (was & bit & ~record->levels)
			out[count++].end = record->sample;
		was = record->levels;
	}
	assert_int_equal(was & bit, 0);
	return count;
}

const struct bit_bang_record *bit_bang_trace_last_change(const struct bit_bang_trace *trace)
{
	int r = trace->count - 1;

	while (r > 0 && trace->records[r].kind != BIT_BANG_LINES)
		r--;
	return &trace->records[r];
}

int bit_bang_trace_count(const struct bit_bang_trace *trace, enum bit_bang_kind kind)
{
	int count = 0;

	for (int r = 0; r < trace->count; r++)
		count += trace->records[r].kind == kind;
	return count;
}

int bit_bang_trace_gaps(const struct bit_bang_trace *trace, int64_t from_ns, int64_t to_ns)
{
	int count = 0;

	for (int r = 0; r < trace->count; r++) {
		const struct bit_bang_record *record = &trace->records[r];

		count += record->kind == BIT_BANG_BEGIN && record->time_ns > from_ns &&
			 record->time_ns < to_ns;
	}
	return count;
}

void bit_bang_trace_print_gaps(const struct bit_bang_trace *trace, int64_t now_ns)
{
	for (int r = 0; r < trace->count; r++)
		if (trace->records[r].kind == BIT_BANG_BEGIN)
			print_message("# no samples until %.1f ms before, at sample %ld\n",
				      (double)(now_ns - trace->records[r].time_ns) / NS_PER_MS,
				      (long)trace->records[r].sample);
}
