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

/* `answered` is called on a camera's thread after it has dealt with control packets: the port that
 * they came to, and when. Set before the cameras start. */
typedef void gige_answered_fn(void *user, int control_fd, int64_t packet_ns);
void gige_loopback_watch(gige_answered_fn *answered, void *user);
