/*
 * What the emulated adapter (bit_bang.c) writes down: every change of its lines, by its own clock.
 */
#pragma once

#include <stdint.h>

enum bit_bang_kind {
	BIT_BANG_LINES, /* they are `levels` from this sample on */
	BIT_BANG_BEGIN, /* it had no samples left, or never had any: this one came just now */
	BIT_BANG_LIT,   /* a packet ended with a line high */
};

struct bit_bang_record {
	int64_t sample;
	int64_t time_ns; /* CLOCK_MONOTONIC when that sample is on the lines */
	uint32_t kind, levels;
};
