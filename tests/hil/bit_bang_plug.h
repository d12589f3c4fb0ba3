/*
 * Plugs emulated adapters (bit_bang.c) in and out.
 */
#pragma once

#include <sys/types.h>

/* Starts one on a bus of its own; it does not outlive the caller. Returns its process, or -1. */
pid_t bit_bang_plug_in(const char *build, int bus, const char *serial, const char *product,
		       const char *ppm, const char *trace);
void bit_bang_unplug(pid_t *adapter); /* 0: there is none */
