/*
 * Figures that are measured apart: time, HD pictures against markers, and cameras that move.
 */
#pragma once

#include <jansson.h>
#include <stdint.h>

/* From the last pictures to the report, and of a recording from its first picture, 8 IR and 3 HD
 * cameras, 100 poses, two processors. Returns 0 or a negative errno. */
int measure_time(json_t *figures, uint64_t seed);

/* How far labelled markers, tracked with a solved rig and interpolated to the HD exposure, lie from
 * their spots in rendered HD pictures by the solved HD models. Returns 0 or a negative errno. */
int measure_hd(json_t *figures, uint64_t seed);

/* How soon a bump of 0.2 mrad is named, and how often nobody is bumped and somebody is named: in
 * `minutes` of each scene. Returns 0 or a negative errno. */
int measure_aim(json_t *figures, uint64_t seed, double minutes);
