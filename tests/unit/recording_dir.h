/*
 * A recording in a directory of its own, made of small images that tell their number, and the
 * camera that plays it. One at a time.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "drivers/camera.h"
#include "drivers/files/files.h"

#define WIDTH_PX 40
#define HEIGHT_PX 32

extern char dir[];
extern struct camera *camera; /* between start_with() and finish() */
extern struct camera_mode granted;

const char *in_dir(const char *name);
void write_bytes(const char *name, const void *bytes, size_t size);
void write_text(const char *name, const char *text);
uint8_t grey_at(int x, int y, int image);
void write_pnm(const char *name, int channels, int image);
void write_png(const char *name, int colour_type, int depth, int image);
int open_camera(const struct camera_driver *driver, struct diag *diag);
void start_with(const struct camera_driver *driver, enum pixel_format format);
void finish(void);
int next(struct frame *frame);
void expect_grey(const struct frame *frame, int image);
int make_dir(void **state);
int remove_dir(void **state);
