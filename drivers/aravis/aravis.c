/*
 * The aravis driver's calls. Received frames (aravis_stream.c) are stamped and lent to the capture
 * thread, which meets neither Aravis' locks nor its allocations. Nobody copies pixels.
 */
#include "drivers/aravis/aravis.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/realtime.h"
#include "drivers/aravis/aravis_stream.h"

#define CLOCK_TRIES 8
#define PATH_BOUND_NS (300 * NS_PER_US) /* of a first packet, where no clock reading tells */

/* Any thread. */
static void on_gone(void *user)
{
	struct aravis_camera *camera = user;

	camera->gone = true;
	sem_post(&camera->ready);
}

/* The watch's thread. */
static void on_look(void *user)
{
	struct aravis_camera *camera = user;

	aravis_ptp_look(&camera->ptp);
}

/* Aravis' heartbeat thread: another program took the camera, or it was started anew. */
static void on_control_lost(ArvDevice *device, void *user)
{
	(void)device;
	on_gone(user);
}

static int aravis_open(struct camera **out, const char *rest, const char *base_dir,
		       struct diag *diag)
{
	struct aravis_camera *camera = calloc(1, sizeof(*camera));
	int error;

	(void)base_dir;
	if (!camera)
		return -ENOMEM;
	camera->base.driver = &aravis_camera_driver;
	snprintf(camera->address, sizeof(camera->address), "aravis:%s", rest);
	error = aravis_open_device(&camera->device, camera->address, rest, diag);
	if (error) {
		free(camera);
		return error;
	}
	sem_init(&camera->ready, 0, 0);
	camera->stamps_middle = aravis_stamps_middle(camera->device);
	g_signal_connect(arv_camera_get_device(camera->device), "control-lost",
			 G_CALLBACK(on_control_lost), camera);
	*out = &camera->base;
	return 0;
}

/* Where nobody tells whether rows are exposed one after the other, the middle one may be later than
 * the first by half of the time that reading takes. */
static struct aravis_rows rows_of(const struct camera_mode *mode)
{
	int64_t readout_ns = mode->readout_ns ? mode->readout_ns : mode->period_ns;

	if (mode->shutter == SHUTTER_UNKNOWN)
		return (struct aravis_rows){0, readout_ns / 2};
	return (struct aravis_rows){mode->row_time_ns * (mode->height_px - 1) / 2, 0};
}

/* Aravis would ask for seconds, and give other reasons. */
static int check_there(const struct aravis_camera *camera, struct diag *diag)
{
	if (!camera->gone && (!arv_camera_is_gv_device(camera->device) ||
			      aravis_probe(aravis_ip(camera->device)) == 0))
		return 0;
	diag_add(diag, "%s: gone: it does not answer: check power and cable", camera->address);
	return -ENODEV;
}

static int aravis_configure(struct camera *base, const struct camera_mode *wanted,
			    struct camera_mode *granted, struct diag *diag)
{
	struct aravis_camera *camera = (struct aravis_camera *)base;
	int error = check_there(camera, diag);

	if (!error)
		error = aravis_configure_device(camera->device, camera->address, wanted,
						&camera->mode, &camera->format, diag);
	if (error)
		return error;
	camera->rows = rows_of(&camera->mode);
	camera->wanted_receive = wanted->receive;
	aravis_ptp_set(&camera->ptp, camera->device, wanted->clock);
	camera->mode.clock = camera->ptp.on ? CAMERA_CLOCK_PTP : CAMERA_CLOCK_DEVICE;
	*granted = camera->mode;
	return 0;
}

/* Without a reading of its clock a device is believed to send as soon as the exposure is over. */
static void start_clock(struct aravis_camera *camera)
{
	struct device_clock reading;

	camera->clock = (struct clock_map){
		.path_ns = camera->stamps_middle ? camera->mode.exposure_ns / 2
						 : camera->mode.exposure_ns,
		.path_bound_ns = PATH_BOUND_NS,
	};
	if (aravis_read_clock(camera->device, CLOCK_TRIES, &reading) == 0)
		clock_map_anchor(&camera->clock, reading.device_ns, reading.host_ns,
				 reading.bound_ns);
}

static void warn_of_clock(const struct aravis_camera *camera)
{
	struct camera_fact clock;

	aravis_ptp_tell(&camera->ptp, &clock);
	if (clock.falls_short)
		log_warning("%s: clock: %s", camera->address, clock.text);
}

static void aravis_stop(struct camera *base);

/* A USB camera that is gone says so itself. */
static int start_watch(struct aravis_camera *camera)
{
	if (!arv_camera_is_gv_device(camera->device))
		return 0;
	camera->watch = (struct aravis_watch){.ip = aravis_ip(camera->device),
					      .frames = &camera->started_count,
					      .gone = on_gone,
					      .look = on_look,
					      .user = camera};
	return aravis_watch_init(&camera->watch);
}

static int aravis_start(struct camera *base, struct diag *diag)
{
	struct aravis_camera *camera = (struct aravis_camera *)base;
	GError *error = NULL;
	int result = check_there(camera, diag);

	if (result)
		return result;
	guint payload_bytes = arv_camera_get_payload(camera->device, &error);

	if (error)
		return aravis_fail(&error, camera->gone ? -ENODEV : -EIO, camera->address,
				   "payload size", diag);
	camera->stopping = false;
	camera->started_count = 0;
	camera->done_count = 0;
	camera->counter = (struct frame_counter){0};
	camera->last_ns = 0;
	start_clock(camera);
	aravis_ptp_look(&camera->ptp);
	warn_of_clock(camera);
	result = aravis_stream_open(camera, payload_bytes, diag);
	if (result)
		goto fail;
	arv_camera_start_acquisition(camera->device, &error);
	result = error ? aravis_fail(&error, -EIO, camera->address, "start", diag)
		       : start_watch(camera);
	if (!result)
		return 0;
fail:
	aravis_stop(base);
	return result;
}

/* The stream of a camera that is gone ends when it is closed. */
static void aravis_stop(struct camera *base)
{
	struct aravis_camera *camera = (struct aravis_camera *)base;

	aravis_watch_finish(&camera->watch);
	if (camera->gone)
		return;
	aravis_stream_close(camera);
	while (sem_trywait(&camera->ready) == 0)
		;
}

static void *bury(void *user)
{
	struct aravis_camera *camera = user;

	aravis_watch_finish(&camera->watch);
	aravis_stream_close(camera);
	g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera->device), camera);
	g_object_unref(camera->device);
	sem_destroy(&camera->ready);
	free(camera);
	return NULL;
}

/* Of a camera that is gone Aravis takes leave for ten seconds: nobody waits for that. */
static void aravis_close(struct camera *base)
{
	struct aravis_camera *camera = (struct aravis_camera *)base;
	pthread_t thread;

	if (!camera)
		return;
	if (camera->gone && pthread_create(&thread, NULL, bury, camera) == 0)
		pthread_detach(thread);
	else
		bury(camera);
}

/* Capture thread. Through the receive thread, but for a pool that ran dry: then Aravis starts no
 * frame, calls nobody, and must be given buffers directly. */
static void give_back(struct aravis_camera *camera, struct aravis_slot *slot)
{
	struct aravis_slot **item = NULL;

	if (ring_count(&camera->released) < camera->slot_count / 2)
		item = ring_claim(&camera->released);
	if (item) {
		*item = slot;
		ring_publish(&camera->released);
		return;
	}
	slot->held = false;
	bool was_in_section = realtime_pause(); /* a lock of Aravis: a documented exception */
	arv_stream_push_buffer(camera->stream, slot->buffer);
	realtime_resume(was_in_section);
}

static int wait_ready(struct aravis_camera *camera, int64_t timeout_ns)
{
	int64_t until_ns = clock_now_ns() + timeout_ns;
	struct timespec until = {.tv_sec = until_ns / NS_PER_S, .tv_nsec = until_ns % NS_PER_S};

	while (sem_clockwait(&camera->ready, CLOCK_MONOTONIC, &until))
		if (errno != EINTR)
			return -errno;
	return 0;
}

static bool whole(const struct aravis_camera *camera, ArvBuffer *buffer, int *stride_bytes)
{
	size_t row_bytes = pixel_row_bytes(camera->mode.format, camera->mode.width_px);
	size_t size_bytes = 0;
	gint x_padding = 0, y_padding = 0;

	if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS ||
	    arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE ||
	    arv_buffer_get_image_pixel_format(buffer) != camera->format ||
	    arv_buffer_get_image_width(buffer) != camera->mode.width_px ||
	    arv_buffer_get_image_height(buffer) != camera->mode.height_px ||
	    !arv_buffer_get_image_data(buffer, &size_bytes))
		return false;
	arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
	if (x_padding < 0 || x_padding > UINT16_MAX)
		return false;
	*stride_bytes = (int)row_bytes + x_padding;
	return size_bytes >= (size_t)*stride_bytes * (size_t)camera->mode.height_px;
}

/* A device stamps the start of an exposure; those that aravis_stamps_middle() knows, the middle. */
static void stamp(struct aravis_camera *camera, const struct aravis_slot *slot, struct frame *out)
{
	int64_t device_ns = (int64_t)arv_buffer_get_timestamp(slot->buffer);

	clock_map_sample(&camera->clock, device_ns, slot->leader_ns);
	if (!aravis_ptp_host_ns(&camera->ptp, device_ns, &out->mid_exposure_ns,
				&out->uncertainty_ns))
		out->mid_exposure_ns =
			clock_map_host_ns(&camera->clock, device_ns, &out->uncertainty_ns);
	if (out->mid_exposure_ns <= camera->last_ns) /* the other clock counts now */
		out->mid_exposure_ns = camera->last_ns + 1;
	camera->last_ns = out->mid_exposure_ns;
	if (!camera->stamps_middle)
		out->mid_exposure_ns += camera->mode.exposure_ns / 2;
	out->mid_exposure_ns += camera->rows.middle_ns;
	out->uncertainty_ns += camera->rows.bound_ns;
	out->arrival_ns = slot->arrival_ns;
}

static int aravis_acquire(struct camera *base, int64_t timeout_ns, struct frame *out)
{
	struct aravis_camera *camera = (struct aravis_camera *)base;
	int error = wait_ready(camera, timeout_ns);
	struct aravis_slot **item = ring_peek(&camera->arrived, 0);

	if (!item)
		return camera->gone ? -ENODEV : error ? error : -ETIMEDOUT;
	struct aravis_slot *slot = *item;
	int stride_bytes;

	ring_pop(&camera->arrived);
	if (!whole(camera, slot->buffer, &stride_bytes)) {
		give_back(camera, slot);
		return -EBADMSG;
	}
	*out = (struct frame){
		.pixels = arv_buffer_get_image_data(slot->buffer, NULL),
		.width_px = camera->mode.width_px,
		.height_px = camera->mode.height_px,
		.stride_bytes = stride_bytes,
		.format = camera->mode.format,
		.bits = camera->mode.bits,
		.row_time_ns = camera->mode.row_time_ns,
		.shot = UINT64_MAX,
		.device_seq = frame_counter_extend(&camera->counter,
						   arv_buffer_get_frame_id(slot->buffer)),
		.token = slot,
	};
	stamp(camera, slot, out);
	return 0;
}

static void aravis_release(struct camera *base, struct frame *frame)
{
	give_back((struct aravis_camera *)base, frame->token);
	frame->token = NULL;
}

const struct camera_driver aravis_camera_driver = {
	.name = "aravis",
	.has_network = true,
	.list = aravis_list,
	.open = aravis_open,
	.close = aravis_close,
	.configure = aravis_configure,
	.start = aravis_start,
	.stop = aravis_stop,
	.acquire = aravis_acquire,
	.release = aravis_release,
	.counts = aravis_counts,
	.facts = aravis_facts,
};
