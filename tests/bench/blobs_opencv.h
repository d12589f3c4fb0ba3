/*
 * The same job with OpenCV, for comparison: threshold, then contours with their moments, or
 * connected components with their centroids. Both return how many spots they found.
 */
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

void opencv_init(int width_px, int height_px); /* one thread, and room for the binary image */
int opencv_contours(const uint8_t *pixels, int width_px, int height_px, int threshold);
int opencv_components(const uint8_t *pixels, int width_px, int height_px, int threshold);

#ifdef __cplusplus
}
#endif
