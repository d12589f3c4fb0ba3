/*
 * A guard that only writes down what it was told: for the trigger in virtual time.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define FAKE_GUARD_WATCHES 16384

struct fake_guard {
	bool dead;                             /* what trigger_guard_lives() denies */
	int64_t untils_ns[FAKE_GUARD_WATCHES]; /* of each watch */
	int64_t until_ns;                      /* 0: it rests */
	uint32_t watches;                      /* times that it was told to watch */
	uint32_t starts;
	uint32_t cut_count;
};

extern struct fake_guard fake_guard;
