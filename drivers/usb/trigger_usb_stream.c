/*
 * Writes are filled in turn. The stream ends, and begins anew on the grid of shots, when the
 * adapter may have run out of samples: when what is refilled comes too late by the clock, or when
 * for a while all is taken later than it should be.
 */
#include "drivers/usb/trigger_usb_stream.h"

#include <errno.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>

#define LEAD_NS (300 * NS_PER_MS)   /* of samples on their way: what a stall may last */
#define LEAD_SHOTS 2                /* at least */
#define LEAD_IN_NS (30 * NS_PER_MS) /* dark: meanwhile the rest is submitted */
#define REFILL_NS (1 * NS_PER_MS)   /* that a write may need to reach the adapter */
#define WINDOW_NS (250 * NS_PER_US) /* of the beginning: good enough */
#define WINDOW_SHARE 32             /* of a period: so is that */
#define TRIES 3
#define HANDLE_NS (100 * NS_PER_MS)
#define SILENCE_NS (2 * NS_PER_S) /* that nothing is taken */
#define SHOTS_NS (4 * NS_PER_S)   /* told and not yet asked for */
#define SHOTS_MIN 16
#define STOP_NS (5 * NS_PER_S) /* what is cancelled comes back, in its time */
#define LEAD_IN_WRITES 64
#define OUT_NS (5 * NS_PER_MS) /* for good measure */
#define PRIORITY 55            /* SCHED_FIFO, between the trigger thread and the cameras */

static uint32_t pending(const struct usb_stream *stream)
{
	return (uint32_t)(stream->submitted - stream->done);
}

static void publish(struct usb_stream *stream)
{
	int64_t taken = atomic_load(&stream->taken_sample), uncertainty_ns;
	int64_t host_ns = usb_pace_host_ns(&stream->pace, taken, &uncertainty_ns);

	atomic_store(&stream->delay_ns, host_ns - usb_pace_device_ns(&stream->pace, taken));
	atomic_store(&stream->uncertainty_ns, uncertainty_ns);
}

/* Whether what is submitted now reaches the adapter before it has put out all from before. */
static bool in_time(struct usb_stream *stream)
{
	int64_t uncertainty_ns;
	int64_t dry_ns = usb_pace_host_ns(&stream->pace, stream->end_sample, &uncertainty_ns);

	return clock_now_ns() + REFILL_NS + uncertainty_ns < dry_ns;
}

static int submit(struct usb_stream *stream, const uint8_t *samples, uint32_t length)
{
	struct ft232h_write *write = &stream->writes[stream->submitted % stream->write_count];

	if (samples)
		memcpy(write->bytes, samples, length);
	else
		memset(write->bytes, 0, length);
	write->length = length;
	write->mark = stream->end_sample + length;
	int err = ft232h_submit(write);
	if (err)
		return err;
	stream->submitted++;
	stream->end_sample += length;
	return 0;
}

/* All of the next shot, and word of it. */
static int send_shot(struct usb_stream *stream)
{
	struct usb_pace *pace = &stream->pace;
	struct usb_shot shot = {.shot = pace->shot,
				.sample = pace->shot_sample,
				.device_ns = usb_pace_device_ns(pace, pace->shot_sample),
				.due_ns = pace->due_ns,
				.events = stream->strange};
	usb_pace_host_ns(pace, shot.sample, &shot.uncertainty_ns);
	uint32_t cuts[USB_WAVE_CUTS_MAX], length = usb_pace_advance(pace);
	uint32_t count = usb_wave_cut(&stream->wave, shot.shot, length, cuts);
	const uint8_t *samples = stream->samples;
	struct usb_shot *slot;
	int err = 0;

	usb_wave_fill(&stream->wave, shot.shot, stream->samples, length);
	for (uint32_t c = 0; c < count && !err; samples += cuts[c++])
		err = submit(stream, samples, cuts[c]);
	stream->strange = 0;
	slot = ring_claim(&stream->shots);
	if (!slot)
		return err; /* nobody asks: its number will be missed */
	*slot = shot;
	ring_publish(&stream->shots);
	return err;
}

/* Dark samples up to the next shot, or that shot. */
static int send_next(struct usb_stream *stream)
{
	int64_t dark = stream->pace.shot_sample - stream->end_sample;
	uint32_t most = stream->wave.period;

	if (dark > 0)
		return submit(stream, NULL, dark > most ? most : (uint32_t)dark);
	return send_shot(stream);
}

static void lose(struct usb_stream *stream, int err)
{
	atomic_store(&stream->lost, err);
	clock_semaphore_post(stream->wake);
}

static bool is_over(const struct usb_stream *stream)
{
	return atomic_load(&stream->stopping) || atomic_load(&stream->lost);
}

static void refill(struct usb_stream *stream)
{
	while (!stream->starved && !atomic_load(&stream->lost) &&
	       pending(stream) + USB_WAVE_CUTS_MAX <= stream->write_count &&
	       stream->end_sample - atomic_load(&stream->taken_sample) < stream->lead) {
		if (!in_time(stream)) {
			stream->starved = true;
			return;
		}
		int err = send_next(stream);
		if (err)
			lose(stream, err);
	}
}

/* From ft232h_handle(). */
static void taken(struct ft232h_write *write, int err)
{
	struct usb_stream *stream = write->user;
	int64_t now_ns = clock_now_ns();

	stream->done++;
	if (err == -ECANCELED)
		return;
	if (err) {
		lose(stream, err);
		return;
	}
	stream->moved_ns = now_ns;
	atomic_store(&stream->taken_sample, write->mark);
	if (stream->beginning)
		return;
	if (write->length % stream->wave.packet == 0 && write->length >= USB_WAVE_FIFO_SAMPLES &&
	    !usb_pace_taken(&stream->pace, write->mark, now_ns))
		stream->starved = true;
	publish(stream);
	clock_semaphore_post(stream->wake);
	if (!atomic_load(&stream->stopping))
		refill(stream);
}

/* An adapter that takes nothing for longer than its samples last is of no more use. */
static void handle(struct usb_stream *stream)
{
	int err = ft232h_handle(stream->adapter, HANDLE_NS);

	if (!err && pending(stream) &&
	    clock_now_ns() - stream->moved_ns > SILENCE_NS + 2 * stream->period_ns)
		err = -EIO;
	if (err)
		lose(stream, err);
}

/* Until what the adapter took was on the lines: what it holds, and a packet that was just coming.
 */
static void wait_until_out(const struct usb_stream *stream)
{
	int64_t samples = USB_WAVE_FIFO_SAMPLES + (int64_t)stream->wave.packet;

	clock_sleep_until(clock_now_ns() + usb_wave_ns(stream->wave.divisor, samples) + OUT_NS);
}

/* Until nothing is on its way. */
static void drain(struct usb_stream *stream)
{
	while (pending(stream) && !is_over(stream))
		handle(stream);
	if (!is_over(stream))
		wait_until_out(stream);
}

/* One packet alone, to see when it is taken, with as many behind it as the rest takes to come. */
static int send_first(struct usb_stream *stream, int64_t *before_ns, int64_t *after_ns)
{
	int64_t lead_in = usb_wave_samples(stream->wave.divisor, LEAD_IN_NS);
	uint64_t first = stream->done;
	int err;

	stream->moved_ns = *before_ns = clock_now_ns();
	err = submit(stream, NULL, stream->wave.packet);
	for (int64_t sent = 0; !err && sent < lead_in; sent += stream->wave.period)
		err = submit(stream, NULL, stream->wave.period);
	while (!err && stream->done == first && !is_over(stream))
		handle(stream);
	*after_ns = clock_now_ns();
	if (!err && stream->done == first)
		err = -ECANCELED;
	return atomic_load(&stream->lost) ? atomic_load(&stream->lost) : err;
}

/* The shorter the time in which the first packet was taken, the better its own is known. */
static int begin(struct usb_stream *stream)
{
	int64_t window_ns = stream->period_ns / WINDOW_SHARE, before_ns, after_ns, first;
	int tries = stream->pace.due_ns ? 1 : TRIES; /* shots are waiting */

	stream->beginning = true;
	if (window_ns < WINDOW_NS)
		window_ns = WINDOW_NS;
	for (int try = 1;; try++) {
		first = stream->end_sample;
		int err = send_first(stream, &before_ns, &after_ns);

		if (err)
			return err;
		if (after_ns - before_ns <= window_ns || try == tries)
			break;
		drain(stream);
	}
	atomic_store(&stream->first_sample, first);
	usb_pace_begin(&stream->pace, &stream->wave, stream->period_ns, first, before_ns, after_ns);
	usb_pace_seek(&stream->pace, stream->end_sample);
	stream->beginning = stream->starved = false;
	publish(stream);
	refill(stream);
	return atomic_load(&stream->lost);
}

/* What was submitted is still put out. */
static void begin_again(struct usb_stream *stream)
{
	stream->strange |= UINT32_C(1) << PULSE_UNDERRUN;
	drain(stream);
	int err = is_over(stream) ? 0 : begin(stream);
	if (err)
		lose(stream, err);
}

static void *run(void *argument)
{
	struct usb_stream *stream = argument;
	struct sched_param param = {.sched_priority = PRIORITY};

	pthread_setschedparam(pthread_self(), SCHED_FIFO, &param); /* where that is allowed */
	while (!is_over(stream)) {
		handle(stream);
		if (stream->starved)
			begin_again(stream);
	}
	return NULL;
}

int usb_stream_start(struct usb_stream *stream)
{
	int err = begin(stream);

	if (!err)
		err = -pthread_create(&stream->thread, NULL, run, stream);
	stream->running = !err;
	if (err)
		usb_stream_stop(stream);
	return err;
}

void usb_stream_stop(struct usb_stream *stream)
{
	int64_t until_ns = clock_now_ns() + STOP_NS;

	if (!stream->writes || atomic_exchange(&stream->stopping, true))
		return;
	if (stream->running)
		pthread_join(stream->thread, NULL);
	stream->running = false;
	for (uint64_t w = stream->done; w < stream->submitted; w++)
		ft232h_cancel(&stream->writes[w % stream->write_count]);
	while (pending(stream) && clock_now_ns() < until_ns)
		ft232h_handle(stream->adapter, HANDLE_NS);
	if (!atomic_load(&stream->lost))
		wait_until_out(stream);
	ring_clear(&stream->shots);
}

static int init_writes(struct usb_stream *stream, uint32_t capacity)
{
	stream->writes = calloc(stream->write_count, sizeof(*stream->writes));
	if (!stream->writes)
		return -ENOMEM;
	for (uint32_t w = 0; w < stream->write_count; w++) {
		int err = ft232h_write_init(stream->adapter, &stream->writes[w], capacity);

		if (err)
			return err;
		stream->writes[w].taken = taken;
		stream->writes[w].user = stream;
	}
	return 0;
}

int usb_stream_init(struct usb_stream *stream, struct ft232h *adapter, const struct usb_wave *wave,
		    int64_t period_ns, struct clock_semaphore *wake)
{
	uint32_t shots = (uint32_t)(LEAD_NS / period_ns) + LEAD_SHOTS;
	uint32_t capacity = wave->period + wave->slack;

	*stream = (struct usb_stream){
		.adapter = adapter, .wave = *wave, .period_ns = period_ns, .wake = wake};
	stream->lead = (int64_t)shots * wave->period;
	stream->write_count = (shots + 1) * USB_WAVE_CUTS_MAX + LEAD_IN_WRITES;
	stream->samples = calloc(1, capacity);
	int err = stream->samples ? init_writes(stream, capacity) : -ENOMEM;
	if (!err)
		err = ring_init(&stream->shots, sizeof(struct usb_shot),
				(uint32_t)(SHOTS_NS / period_ns) + SHOTS_MIN);
	if (err)
		usb_stream_finish(stream);
	return err;
}

/* What does not come back stays the library's. */
void usb_stream_finish(struct usb_stream *stream)
{
	usb_stream_stop(stream);
	for (uint32_t w = 0; !pending(stream) && stream->writes && w < stream->write_count; w++)
		ft232h_write_finish(&stream->writes[w]);
	if (!pending(stream))
		free(stream->writes);
	free(stream->samples);
	ring_finish(&stream->shots);
	memset(stream, 0, sizeof(*stream));
}
