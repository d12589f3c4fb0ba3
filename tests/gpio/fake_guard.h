/*
 * A guard that writes down what it was told, and acts when it is next looked at: for the trigger in
 * virtual time.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define FAKE_GUARD_WATCHES 32768

struct fake_guard {
	bool dead; /* what trigger_guard_lives() denies */
	struct {
		int64_t at_ns, until_ns; /* 0: told to rest */
	} told[FAKE_GUARD_WATCHES];
	uint32_t told_count;
	int64_t until_ns; /* of the last; 0: it rests */
	int lines_fd;
	uint32_t count, dark_levels;
	uint32_t starts;
	uint32_t cut_count;
};

extern struct fake_guard fake_guard;
