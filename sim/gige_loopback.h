/*
 * Repairs of Aravis' fake camera, for a program that does nothing but serve cameras: linking this
 * file replaces a few functions of GLib and libc for the libraries of the whole process.
 */
#pragma once

#include <stdint.h>

#include "track/observe.h"

/* From now on the addresses first, first + 1, ... are interfaces of the machine in Aravis' eyes.
 * All of 127.0.0.0/8 answers on Linux without set-up, but Aravis serves listed addresses only.
 * At most CAMERA_MAX. */
void gige_loopback_offer(const char *first_address, uint32_t count);
