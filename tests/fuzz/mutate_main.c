/*
 * Runs a fuzz target over damaged copies of good inputs, where there is no libFuzzer:
 *   fuzz_NAME RUNS FILE...
 * The same arguments give the same inputs. Success is to come back from every run.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/rng.h"
#include "tests/fuzz/fuzz_target.h"

#define INPUT_MAX (64 << 10)

struct input {
	uint8_t bytes[INPUT_MAX];
	size_t size;
};

static const char *const tokens[] = {
	"-",
	"[",
	"]",
	"{",
	"}",
	"*a",
	"&a",
	":",
	",",
	"\n",
	"\n- ",
	"'",
	"\"",
	"\\",
	"nan",
	"1e999",
	"0x7f",
	"..",
	"/",
	"#",
	"99999999999999999999",
	"\xff",
	"\xef\xbb\xbf",
};

static uint32_t below(struct rng *rng, size_t limit)
{
	return limit ? rng_u32(rng) % (uint32_t)limit : 0;
}

static void insert(struct input *input, size_t at, const void *bytes, size_t size)
{
	uint8_t copy[256];

	if (size > sizeof(copy) || input->size + size > INPUT_MAX)
		return;
	memcpy(copy, bytes, size); /* it may come from the input itself */
	memmove(input->bytes + at + size, input->bytes + at, input->size - at);
	memcpy(input->bytes + at, copy, size);
	input->size += size;
}

static void mutate(struct input *input, struct rng *rng)
{
	size_t at = below(rng, input->size), left = input->size - at;
	size_t count = 1 + below(rng, left < 64 ? left : 64);

	if (!input->size)
		return;
	switch (below(rng, 6)) {
	case 0:
		input->bytes[at] ^= (uint8_t)(1u << below(rng, 8));
		break;
	case 1:
		input->bytes[at] = (uint8_t)rng_u32(rng);
		break;
	case 2: {
		const char *token = tokens[below(rng, sizeof(tokens) / sizeof(tokens[0]))];
		insert(input, at, token, strlen(token));
		break;
	}
	case 3:
		count = count < left ? count : left;
		memmove(input->bytes + at, input->bytes + at + count, left - count);
		input->size -= count;
		break;
	case 4:
		insert(input, below(rng, input->size), input->bytes + at,
		       count < left ? count : left);
		break;
	default:
		input->size = below(rng, 8) ? input->size : at; /* truncated */
		break;
	}
}

static int read_seed(struct input *seed, const char *path)
{
	FILE *file = fopen(path, "r");

	if (!file) {
		perror(path);
		return -1;
	}
	seed->size = fread(seed->bytes, 1, INPUT_MAX / 2, file);
	fclose(file);
	return 0;
}

int main(int argc, char **argv)
{
	static struct input seed, input;
	int runs = argc > 1 ? atoi(argv[1]) : 0;
	struct rng rng;

	rng_init(&rng, 1, 1);
	for (int i = 2; i < argc; i++) {
		if (read_seed(&seed, argv[i]))
			return 1;
		LLVMFuzzerTestOneInput(seed.bytes, seed.size);
		for (int run = 0; run < runs; run++) {
			input = seed;
			for (uint32_t n = 1 + below(&rng, 6); n > 0; n--)
				mutate(&input, &rng);
			/* of its own size, so that reading past its end is noticed */
			uint8_t *exact = malloc(input.size + !input.size);
			if (!exact)
				return 1;
			memcpy(exact, input.bytes, input.size);
			LLVMFuzzerTestOneInput(exact, input.size);
			free(exact);
		}
	}
	return 0;
}
