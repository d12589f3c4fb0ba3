/*
 * libcamera behind C, as thin as it can be: cameras by their ids, formats by libcamera's names,
 * requests by the number of their buffer. No policy and no words: those are the driver's. All calls
 * on the control thread, where not said otherwise.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LIBCAMERA_FORMAT_BYTES 24
#define LIBCAMERA_BUFFERS_MAX 64

struct libcamera_device; /* a camera that is ours */

typedef void libcamera_found_fn(const char *id, const char *model, void *user);

/* One size of one format of a stream. `format` is libcamera's name ("R8", "SRGGB10_CSI2P"). */
typedef void libcamera_offer_fn(bool raw, const char *format, int width_px, int height_px,
				void *user);

struct libcamera_stream {
	bool raw; /* as the sensor gives it; else processed */
	char format[LIBCAMERA_FORMAT_BYTES];
	int width_px, height_px;
	uint32_t buffer_count;
	int stride_bytes; /* granted */
};

/* The first plane of a buffer; `fd` is the device's own. */
struct libcamera_plane {
	int fd;
	size_t offset_bytes, size_bytes;
};

enum libcamera_setting {
	LIBCAMERA_EXPOSURE_US,
	LIBCAMERA_GAIN, /* a factor */
	LIBCAMERA_PERIOD_US,
	LIBCAMERA_SETTING_COUNT
};

/* What is to be set at the start; 0 leaves it to the camera. Manual exposure switches automatic
 * off. */
struct libcamera_light {
	double values[LIBCAMERA_SETTING_COUNT];
};

enum libcamera_end { LIBCAMERA_WHOLE, LIBCAMERA_DAMAGED, LIBCAMERA_CANCELLED };

/* A request that is over. */
struct libcamera_done {
	uint32_t buffer;
	enum libcamera_end end;
	uint32_t sequence;
	int64_t stamp_ns;    /* SensorTimestamp; 0: none */
	int64_t exposure_ns; /* of this very frame; 0: not told */
	size_t used_bytes;   /* of the first plane */
};

/* Both on libcamera's own thread. */
struct libcamera_hooks {
	void (*done)(void *user, const struct libcamera_done *done);
	void (*gone)(void *user); /* unplugged */
	void *user;
};

/* libcamera looks for cameras when it starts, which takes its time: from hold to let_go, and while
 * a camera is open, it stays as it is. 0 or a negative errno. */
int libcamera_shim_hold(void);
void libcamera_shim_let_go(void);

/* Every camera that libcamera can see now; how many, or a negative errno. */
int libcamera_shim_list(libcamera_found_fn *found, void *user);

/* -ENODEV: no such id; -EBUSY: another program's; or another negative errno. */
int libcamera_shim_open(struct libcamera_device **out, const char *id);
void libcamera_shim_close(struct libcamera_device *device);

/* In place of stop and close, of a camera whose device is gone: libcamera ends the process when it
 * is asked to stop one (0.0.3 and 0.4 assert that all requests come back, and those do not). What
 * it holds of this camera is left behind. */
void libcamera_shim_abandon(struct libcamera_device *device);

/* The sensor's name; until close. */
const char *libcamera_shim_model(const struct libcamera_device *device);

void libcamera_shim_offers(struct libcamera_device *device, libcamera_offer_fn *offer, void *user);

/* Sets the stream, of the size that libcamera chooses where it is 0, and makes its buffers.
 * `stream` gets what was granted: with another format or size nothing was set. 0 or a negative
 * errno. */
int libcamera_shim_configure(struct libcamera_device *device, struct libcamera_stream *stream);

/* Of the stream that is set. */
struct libcamera_plane libcamera_shim_plane(const struct libcamera_device *device, uint32_t buffer);

/* What the camera can be set to; false: not at all. */
bool libcamera_shim_range(const struct libcamera_device *device, enum libcamera_setting setting,
			  double *low, double *high);

/* Every buffer is the camera's from then on, until its request is done. */
int libcamera_shim_start(struct libcamera_device *device, const struct libcamera_light *light,
			 const struct libcamera_hooks *hooks);

/* No hook is called any more once it returns. */
void libcamera_shim_stop(struct libcamera_device *device);

/* Gives a buffer whose request is done to the camera again. Any one thread, before stop; it locks
 * and allocates. */
int libcamera_shim_queue(struct libcamera_device *device, uint32_t buffer);

#ifdef __cplusplus
}
#endif
