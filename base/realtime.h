/*
 * Real-time sections: code that may not allocate, lock, log or wait on a slower thread. Marking
 * them costs nothing that counts; tests/rt preloads a guard that reads the mark and aborts on such
 * calls.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/* The calling thread is in a section from enter to leave. Sections do not nest. */
void realtime_enter(void);
void realtime_leave(void);

/* Around a foreign call that is a documented exception (docs/architecture.md). Returns whether
 * there was a section to pause; resume takes that answer. */
bool realtime_pause(void);
void realtime_resume(bool was_in_section);

/* Of the calling thread. Programs export it, so that the guard finds it. */
bool realtime_in_section(void);

/* Brings every page of `memory` into RAM, with its contents as they are. Before the threads start:
 * calloc promises zeros and no pages. */
void realtime_touch(void *memory, size_t size_bytes);
