/*
 * A fuzz target's entry, by libFuzzer's convention. With clang: build a fuzz_NAME.c and the sources
 * it tests with -fsanitize=fuzzer,address and leave mutate_main.c out.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
