/*
 * The aravis driver's stream: the buffers that frames come in, and what Aravis' receive thread does
 * with them.
 */
#include "drivers/aravis/aravis_stream.h"

#include <errno.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"

#define POOL_NS (250 * NS_PER_MS) /* a capture thread may stall this long */
#define POOL_MIN 16
#define PAGE_BYTES 4096
#define RETENTION_US 20000u /* a frame with packets missing holds up the next ones */
#define ASK_AGAIN_US 3000u  /* for a missing packet; Aravis' own 20 ms would be too late */
#define RECEIVE_PRIORITY 55 /* above the capture threads, below the trigger */

/* Gives Aravis the buffers that the capture thread is done with. Receive thread. */
static void take_back_released(struct aravis_camera *camera)
{
	for (struct aravis_slot **item; (item = ring_peek(&camera->released, 0));
	     ring_pop(&camera->released)) {
		(*item)->held = false;
		arv_stream_push_buffer(camera->stream, (*item)->buffer);
	}
}

/* Aravis has just queued the frame for us; it goes on to the capture thread. Receive thread. */
static void hand_over(struct aravis_camera *camera)
{
	ArvBuffer *buffer = arv_stream_try_pop_buffer(camera->stream);

	if (!buffer)
		return;
	struct aravis_slot *slot = (struct aravis_slot *)arv_buffer_get_user_data(buffer);
	struct aravis_slot **item =
		ring_claim(&camera->arrived); /* never full: it holds all slots */

	slot->leader_ns = camera->leaders_ns[camera->done_count++ % ARAVIS_POOL_MAX];
	slot->arrival_ns = clock_now_ns();
	slot->held = true;
	*item = slot;
	ring_publish(&camera->arrived);
	sem_post(&camera->ready);
}

static void become_realtime(void)
{
	struct sched_param param = {.sched_priority = RECEIVE_PRIORITY};

	/* Where it is not allowed the receiver works, with more jitter: doctor's business. */
	pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
	pthread_setname_np(pthread_self(), "aravis-receive");
}

/* Receive thread. */
static void on_stream(void *user, ArvStreamCallbackType type, ArvBuffer *buffer)
{
	struct aravis_camera *camera = user;

	(void)buffer;
	if (type == ARV_STREAM_CALLBACK_TYPE_INIT) {
		become_realtime();
	} else if (camera->stopping) {
		return;
	} else if (type == ARV_STREAM_CALLBACK_TYPE_START_BUFFER) {
		camera->leaders_ns[camera->started_count++ % ARAVIS_POOL_MAX] = clock_now_ns();
		take_back_released(camera);
	} else if (type == ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE) {
		hand_over(camera);
		take_back_released(camera);
	}
}

static uint32_t pool_size(const struct camera_mode *mode)
{
	int64_t count = mode->period_ns > 0 ? POOL_NS / mode->period_ns + 4 : 0;

	return (uint32_t)(count < POOL_MIN          ? POOL_MIN
			  : count > ARAVIS_POOL_MAX ? ARAVIS_POOL_MAX
						    : count);
}

/* Every page is touched here, so that no frame waits for one. */
static int create_pool(struct aravis_camera *camera, size_t payload_bytes)
{
	size_t slot_bytes = (payload_bytes + PAGE_BYTES - 1) / PAGE_BYTES * PAGE_BYTES;
	uint32_t count = pool_size(&camera->mode);

	if (ring_init(&camera->arrived, sizeof(struct aravis_slot *), ARAVIS_POOL_MAX) ||
	    ring_init(&camera->released, sizeof(struct aravis_slot *), ARAVIS_POOL_MAX))
		return -ENOMEM;
	camera->memory = aligned_alloc(PAGE_BYTES, slot_bytes * count);
	if (!camera->memory)
		return -ENOMEM;
	memset(camera->memory, 0, slot_bytes * count);
	for (uint32_t i = 0; i < count; i++) {
		struct aravis_slot *slot = &camera->slots[i];

		*slot = (struct aravis_slot){.held = true};
		slot->buffer = arv_buffer_new_full(payload_bytes, camera->memory + i * slot_bytes,
						   slot, NULL);
		g_object_ref(slot->buffer);
	}
	camera->slot_count = count;
	return 0;
}

static void destroy_pool(struct aravis_camera *camera)
{
	for (uint32_t i = 0; i < camera->slot_count; i++) {
		if (camera->slots[i].held)
			g_object_unref(camera->slots[i].buffer);
		g_object_unref(camera->slots[i].buffer);
	}
	camera->slot_count = 0;
	free(camera->memory);
	camera->memory = NULL;
	ring_finish(&camera->arrived);
	ring_finish(&camera->released);
}

static int create_stream(struct aravis_camera *camera, size_t payload_bytes, struct diag *diag)
{
	GError *error = NULL;

	camera->stream = arv_camera_create_stream(camera->device, on_stream, camera, &error);
	if (!camera->stream)
		return aravis_fail(&error, -EIO, camera->address, "stream", diag);
	camera->resends = aravis_resends(camera->device);
	if (ARV_IS_GV_STREAM(camera->stream)) {
		g_object_set(camera->stream, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
			     "socket-buffer-size", -1, "packet-resend",
			     camera->resends ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS
					     : ARV_GV_STREAM_PACKET_RESEND_NEVER,
			     "packet-timeout", ASK_AGAIN_US, "frame-retention", RETENTION_US, NULL);
		if (camera->mode.receive == CAMERA_RECEIVE_SOCKET)
			aravis_widen_socket(camera->stream, camera->address, payload_bytes);
	}
	for (uint32_t i = 0; i < camera->slot_count; i++) {
		camera->slots[i].held = false;
		arv_stream_push_buffer(camera->stream, camera->slots[i].buffer);
	}
	return 0;
}

int aravis_stream_open(struct aravis_camera *camera, size_t payload_bytes, struct diag *diag)
{
	int error = create_pool(camera, payload_bytes);

	return error ? error : create_stream(camera, payload_bytes, diag);
}

static void report_losses(struct aravis_camera *camera)
{
	guint64 completed = 0, failures = 0, underruns = 0;

	arv_stream_get_statistics(camera->stream, &completed, &failures, &underruns);
	if (failures || underruns)
		log_warning("%s: of %" PRIu64 " frames %" PRIu64 " came damaged; %" PRIu64
			    " packets found no free buffer",
			    camera->address, (uint64_t)(completed + failures), (uint64_t)failures,
			    (uint64_t)underruns);
}

void aravis_stream_close(struct aravis_camera *camera)
{
	if (camera->stream) {
		if (!camera->gone)
			arv_camera_stop_acquisition(camera->device, NULL);
		report_losses(camera);
		camera->stopping = true; /* buffers now die with the stream */
		g_clear_object(&camera->stream);
	}
	destroy_pool(camera);
}
