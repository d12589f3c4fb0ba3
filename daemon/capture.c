/*
 * The capture thread. It neither allocates, locks nor logs: it counts.
 */
#include "daemon/capture.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>

#include "base/clock_virtual.h"
#include "base/realtime.h"
#include "drivers/frame_image.h"

#define ACQUIRE_TIMEOUT_NS (100 * NS_PER_MS)
#define TIME_OFF_MAX_NS NS_PER_S

static void count(_Atomic uint64_t *counter, uint64_t more)
{
	atomic_fetch_add_explicit(counter, more, memory_order_relaxed);
}

static bool frame_as_granted(const struct capture *capture, const struct frame *frame)
{
	const struct camera_mode *granted = &capture->device.granted;

	return frame->width_px == granted->width_px && frame->height_px == granted->height_px &&
	       frame->format == granted->format;
}

/* A clock that was never mapped to ours would make shots of its own. */
static bool time_plausible(const struct frame *frame)
{
	int64_t off_ns;

	if (__builtin_sub_overflow(frame->arrival_ns, frame->mid_exposure_ns, &off_ns))
		return false;
	return off_ns < TIME_OFF_MAX_NS && off_ns > -TIME_OFF_MAX_NS;
}

static void count_gap(struct capture *capture, uint64_t seq)
{
	if (capture->has_seq && seq > capture->last_seq + 1)
		count(&capture->counters.device_gaps, seq - capture->last_seq - 1);
	capture->has_seq = true;
	capture->last_seq = seq;
}

static void copy_preview(struct capture *capture, const struct frame *frame,
			 const struct blob_set *set)
{
	struct preview *preview = &capture->preview;
	size_t row_bytes = pixel_row_bytes(frame->format, frame->width_px);

	if (row_bytes * (size_t)frame->height_px > preview->capacity_bytes)
		return;
	for (int y = 0; y < frame->height_px; y++)
		memcpy(preview->pixels + (size_t)y * row_bytes,
		       frame->pixels + (ptrdiff_t)y * frame->stride_bytes, row_bytes);
	preview->size_bytes = row_bytes * (size_t)frame->height_px;
	preview->width_px = frame->width_px;
	preview->height_px = frame->height_px;
	preview->format = frame->format;
	preview->set.blob_count = 0;
	if (set)
		preview->set = *set;
	preview->set.shot = frame->shot;
	preview->set.mid_exposure_ns = frame->mid_exposure_ns;
	atomic_store_explicit(&preview->state, PREVIEW_READY, memory_order_release);
	eventfd_write(capture->control_wake_fd, 1);
}

/* Fills a set in place, in the ring. NULL when the ring is full. */
static struct blob_set *find_blobs(struct capture *capture, const struct frame *frame)
{
	struct grey_image image = frame_grey_image(frame);
	struct blob_set *set = ring_claim(&capture->sets);

	if (!set) {
		count(&capture->counters.refused, 1);
		return NULL;
	}
	set->shot = frame->shot;
	set->device_seq = frame->device_seq;
	set->mid_exposure_ns = frame->mid_exposure_ns;
	set->uncertainty_ns = frame->uncertainty_ns;
	set->arrival_ns = frame->arrival_ns;
	blob_finder_run(capture->finder, &image, set);
	count(&capture->counters.blobs_masked, mask_apply(capture->mask_in_use, set));
	set->found_ns = clock_now_ns();
	count(&capture->counters.blobs, set->blob_count);
	count(&capture->counters.blobs_lost, set->blobs_lost);
	return set;
}

static void take_hd_frame(struct capture *capture, const struct frame *frame)
{
	if (!hd_capture_keep(&capture->hd, frame)) {
		count(&capture->counters.refused, 1);
		return;
	}
	if (atomic_load_explicit(&capture->preview.state, memory_order_acquire) != PREVIEW_WANTED)
		return;
	atomic_store_explicit(&capture->preview.state, PREVIEW_READY, memory_order_release);
	eventfd_write(capture->control_wake_fd, 1);
}

static void take_ir_frame(struct capture *capture, const struct frame *frame)
{
	struct blob_set *set = find_blobs(capture, frame);

	if (atomic_load_explicit(&capture->preview.state, memory_order_acquire) == PREVIEW_WANTED)
		copy_preview(capture, frame, set);
	if (set) {
		ring_publish(&capture->sets);
		clock_semaphore_post(capture->solver_wake);
	}
}

static void take_frame(struct capture *capture, const struct frame *frame)
{

	count_gap(capture, frame->device_seq);
	if (!frame_as_granted(capture, frame)) {
		count(&capture->counters.wrong_size, 1);
		return;
	}
	if (!time_plausible(frame)) {
		count(&capture->counters.wrong_time, 1);
		return;
	}
	count(&capture->counters.frames, 1);
	if (capture->pictures)
		pictures_share_put(capture->pictures, capture->index, frame);
	if (capture->role == ROLE_IR)
		take_ir_frame(capture, frame);
	else
		take_hd_frame(capture, frame);
}

/* Returns what the capture has become. */
static enum capture_state capture_once(struct capture *capture)
{
	const struct camera_driver *driver = capture->device.driver;
	struct frame frame;
	int err = driver->acquire(capture->device.camera, ACQUIRE_TIMEOUT_NS, &frame);

	switch (err) {
	case 0:
		take_frame(capture, &frame);
		driver->release(capture->device.camera, &frame);
		return CAPTURE_RUNNING;
	case -ETIMEDOUT:
		count(&capture->counters.timeouts, 1);
		return CAPTURE_RUNNING;
	case -EBADMSG:
		count(&capture->counters.damaged, 1);
		return CAPTURE_RUNNING;
	case -ENODATA:
		return CAPTURE_ENDED;
	default:
		atomic_store(&capture->lost_error, err);
		return CAPTURE_LOST;
	}
}

static void run_capture(void *argument)
{
	struct capture *capture = argument;
	enum capture_state state = CAPTURE_RUNNING;

	while (state == CAPTURE_RUNNING &&
	       !atomic_load_explicit(&capture->stopping, memory_order_relaxed)) {
		heartbeat_beat(&capture->thread.heartbeat);
		capture->mask_in_use = handover_take(&capture->masks);
		state = capture_once(capture);
	}
	atomic_store(&capture->state, state == CAPTURE_RUNNING ? CAPTURE_STOPPED : state);
	clock_semaphore_post(capture->solver_wake);
	eventfd_write(capture->control_wake_fd, 1);
}

static size_t image_bytes(const struct camera_mode *mode)
{
	return pixel_row_bytes(mode->format, mode->width_px) * (size_t)mode->height_px;
}

static int init_ir(struct capture *capture, const struct camera_mode *mode,
		   const struct blob_settings *settings, uint32_t queue_length)
{
	capture->preview.capacity_bytes = image_bytes(mode);
	capture->preview.pixels = calloc(1, capture->preview.capacity_bytes);
	if (!capture->preview.pixels)
		return -ENOMEM;
	realtime_touch(capture->preview.pixels, capture->preview.capacity_bytes);
	int err = ring_init(&capture->sets, sizeof(struct blob_set), queue_length);
	if (err)
		return err;
	return blob_finder_create(&capture->finder, mode->width_px, mode->height_px, settings);
}

int capture_init(struct capture *capture, const struct config_camera *camera,
		 const struct open_camera *device, const struct blob_settings *settings,
		 uint32_t queue_length)
{
	const struct camera_mode *mode = &device->granted;
	int err = 0;

	memset(capture, 0, sizeof(*capture));
	memcpy(capture->name, camera->name, sizeof(capture->name));
	capture->role = camera->role;
	capture->mask = malloc(sizeof(*capture->mask));
	if (!capture->mask) {
		capture_finish(capture);
		return -ENOMEM;
	}
	*capture->mask = camera->mask;
	handover_init(&capture->masks, capture->mask);
	err = camera->role == ROLE_IR
		      ? init_ir(capture, mode, settings, queue_length)
		      : hd_capture_init(&capture->hd, image_bytes(mode),
					mode->period_ns > 0 ? mode->period_ns
							    : camera->wanted.period_ns);
	if (err) {
		capture_finish(capture);
		return err;
	}
	capture->device = *device;
	capture->own_exposure_ns = mode->exposure_ns;
	return 0;
}

void capture_finish(struct capture *capture)
{
	if (capture->device.camera)
		capture->device.driver->close(capture->device.camera);
	blob_finder_destroy(capture->finder);
	ring_finish(&capture->sets);
	hd_capture_finish(&capture->hd);
	free(capture->preview.pixels);
	free(capture->mask_before);
	free(capture->mask);
	memset(capture, 0, sizeof(*capture));
}

void capture_begin_run(struct capture *capture)
{
	ring_clear(&capture->sets);
	if (capture->role == ROLE_HD)
		hd_capture_begin_run(&capture->hd);
	memset(&capture->counters, 0, sizeof(capture->counters));
	capture->damage_told = false;
	capture->events_told = 0;
}

void capture_lose(struct capture *capture, const char *why)
{
	size_t length = strcspn(why, "\n");

	if (length >= sizeof(capture->lost_why))
		length = sizeof(capture->lost_why) - 1;
	if (!capture->lost_since_ns)
		capture->lost_since_ns = clock_now_ns();
	memcpy(capture->lost_why, why, length);
	capture->lost_why[length] = '\0';
	atomic_store(&capture->state, CAPTURE_LOST);
}

int capture_set_mask(struct capture *capture, const struct mask *mask)
{
	if (!capture->thread.joinable)
		handover_take(&capture->masks); /* nobody else does */
	if (!handover_settled(&capture->masks))
		return -EBUSY;
	struct mask *copy = malloc(sizeof(*copy));

	if (!copy)
		return -ENOMEM;
	*copy = *mask;
	free(capture->mask_before);
	capture->mask_before = capture->mask;
	capture->mask = copy;
	handover_offer(&capture->masks, copy);
	return 0;
}

int capture_set_light(struct capture *capture, const struct camera_mode *wanted, struct diag *diag)
{
	struct open_camera *device = &capture->device;
	struct camera_mode granted;

	if (wanted->period_ns == device->wanted.period_ns &&
	    wanted->exposure_ns == device->wanted.exposure_ns)
		return 0;
	int err = device->driver->configure(device->camera, wanted, &granted, diag);
	if (err)
		return err;
	if (granted.width_px != device->granted.width_px ||
	    granted.height_px != device->granted.height_px ||
	    granted.format != device->granted.format) {
		diag_add(diag,
			 "camera %s: with another exposure its images are %dx%d, not %dx%d: give "
			 "width and height in the config",
			 capture->name, granted.width_px, granted.height_px,
			 device->granted.width_px, device->granted.height_px);
		return -EINVAL;
	}
	device->wanted = *wanted;
	device->granted = granted;
	return 0;
}

int capture_start(struct capture *capture, struct diag *diag)
{
	const struct camera_driver *driver = capture->device.driver;
	int err = driver->start(capture->device.camera, diag);

	if (err)
		return err;
	capture->has_seq = false;
	capture->lost_since_ns = 0;
	atomic_store(&capture->stopping, false);
	atomic_store(&capture->state, CAPTURE_RUNNING);
	capture->thread.name = capture->name;
	capture->thread.run = run_capture;
	capture->thread.argument = capture;
	err = realtime_thread_start(&capture->thread, PRIORITY_CAPTURE);
	if (err) {
		diag_add(diag, "camera %s: cannot start its thread: %s", capture->name,
			 strerror(-err));
		atomic_store(&capture->state, CAPTURE_STOPPED);
		driver->stop(capture->device.camera);
		return err;
	}
	return 0;
}

void capture_tell_to_stop(struct capture *capture)
{
	atomic_store(&capture->stopping, true);
	realtime_thread_tell(&capture->thread);
}

bool capture_stop(struct capture *capture)
{
	if (!capture->thread.joinable)
		return true;
	capture_tell_to_stop(capture);
	if (!realtime_thread_join(&capture->thread))
		return false;
	capture->device.driver->stop(capture->device.camera);
	return true;
}

void capture_request_preview(struct capture *capture)
{
	int state = atomic_load(&capture->preview.state);

	if (state != PREVIEW_WANTED)
		atomic_store_explicit(&capture->preview.state, PREVIEW_WANTED,
				      memory_order_release);
}
