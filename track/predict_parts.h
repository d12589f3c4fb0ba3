/*
 * What the files of the prediction share.
 */
#pragma once

/* Of a displacement: what is left is no share of a smaller one. */
#define SMALL_M2 (0.005 * 0.005)
#define SPREAD_MIN_M2 (0.0005 * 0.0005)
