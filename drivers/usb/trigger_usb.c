/*
 * Trigger on a USB adapter. The stream (trigger_usb_stream.h) has a shot's samples on their way
 * long before they are on the lines; here a shot is told when it has had its light.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/trigger_plan.h"
#include "drivers/usb/trigger_usb.h"
#include "drivers/usb/trigger_usb_stream.h"

#define PACKET_BYTES 512
#define WHO_BYTES (FT232H_NAME_BYTES + 16)
#define DRIFT_SHARE 5000 /* of the age of a reading: what the clocks may have moved apart */

struct usb_trigger {
	struct trigger base;
	/* set when opened */
	char who[WHO_BYTES];
	struct usb_address address;
	struct ft232h *adapter;
	struct clock_semaphore wake;
	/* set when armed */
	struct usb_stream stream;
	_Atomic bool armed;
	/* trigger thread */
	bool any;
	uint64_t last_shot;
};

static void usb_close(struct trigger *base)
{
	struct usb_trigger *trigger = (struct usb_trigger *)base;

	if (!trigger)
		return;
	usb_stream_finish(&trigger->stream);
	ft232h_close(trigger->adapter);
	clock_semaphore_finish(&trigger->wake);
	free(trigger);
}

static int open_adapter(struct usb_trigger *trigger, struct diag *diag)
{
	const uint8_t *bits = trigger->address.bits;
	int err = ft232h_open(&trigger->adapter, trigger->address.adapter, trigger->who, diag);

	if (err)
		return err;
	err = ft232h_set_outputs(trigger->adapter,
				 bits[PULSE_IR] | bits[PULSE_STROBE] | bits[PULSE_HD]);
	if (err)
		diag_add(diag, "%s: the adapter does not answer: %s; plug it in anew", trigger->who,
			 strerror(-err));
	return err;
}

/* As messages have it, without the lines. */
static void name(char who[WHO_BYTES], const char *rest)
{
	size_t length = strcspn(rest, ",");
	bool named = length > 0 && length < FT232H_NAME_BYTES && !memchr(rest, '=', length);

	snprintf(who, WHO_BYTES, "trigger usb%s%.*s", named ? ":" : "", named ? (int)length : 0,
		 rest);
}

struct listener {
	trigger_found_fn *found;
	void *user;
};

static void tell_adapter(const struct ft232h_info *adapter, void *user)
{
	const struct listener *listener = user;
	struct trigger_info info = {.lines = "D0 to D7"};

	snprintf(info.address, sizeof(info.address), "usb:%s",
		 adapter->serial[0] ? adapter->serial : adapter->port);
	snprintf(info.device, sizeof(info.device), "FT232H at %s%s%s", adapter->port,
		 adapter->error ? ", cannot be opened: " : "",
		 adapter->error ? strerror(-adapter->error) : "");
	listener->found(&info, listener->user);
}

static int usb_list(trigger_found_fn *found, void *user, struct diag *diag)
{
	struct listener listener = {found, user};

	return ft232h_list(tell_adapter, &listener, "trigger usb", diag);
}

/* A plan is asked about the packets of a high-speed port, the largest. */
static int usb_check(const char *rest, const struct trigger_plan *plan, struct diag *diag)
{
	struct usb_address address;
	struct usb_wave wave;
	char who[WHO_BYTES];

	name(who, rest);
	int err = usb_address_parse(&address, rest, who, diag);
	return err || !plan ? err
			    : usb_wave_make(&wave, plan, address.bits, PACKET_BYTES, who, diag);
}

static int usb_open(struct trigger **out, const char *rest, struct diag *diag)
{
	struct usb_trigger *trigger = calloc(1, sizeof(*trigger));

	if (!trigger) {
		diag_add(diag, "trigger usb: out of memory");
		return -ENOMEM;
	}
	trigger->base.driver = &usb_trigger_driver;
	clock_semaphore_init(&trigger->wake);
	name(trigger->who, rest);
	int err = usb_address_parse(&trigger->address, rest, trigger->who, diag);
	if (!err)
		err = open_adapter(trigger, diag);
	if (err) {
		usb_close(&trigger->base);
		return err;
	}
	*out = &trigger->base;
	return 0;
}

static void usb_disarm(struct trigger *base)
{
	struct usb_trigger *trigger = (struct usb_trigger *)base;

	atomic_store(&trigger->armed, false);
	usb_stream_stop(&trigger->stream);
}

static int begin(struct usb_trigger *trigger, const struct usb_wave *wave, int64_t period_ns)
{
	int err = ft232h_set_divisor(trigger->adapter, wave->divisor);

	if (!err)
		err = usb_stream_init(&trigger->stream, trigger->adapter, wave, period_ns,
				      &trigger->wake);
	return err ? err : usb_stream_start(&trigger->stream);
}

static int usb_arm(struct trigger *base, const struct trigger_plan *plan, struct diag *diag)
{
	struct usb_trigger *trigger = (struct usb_trigger *)base;
	struct usb_wave wave;
	int err = trigger_plan_check(plan, trigger->who + strlen("trigger "), diag);

	if (!err)
		err = usb_wave_make(&wave, plan, trigger->address.bits,
				    ft232h_packet_bytes(trigger->adapter), trigger->who, diag);
	if (err)
		return err;
	usb_disarm(base);
	usb_stream_finish(&trigger->stream);
	trigger->any = false;
	err = begin(trigger, &wave, plan->period_ns);
	if (err)
		diag_add(diag, "%s: the adapter takes no samples: %s; plug it in anew",
			 trigger->who, strerror(-err));
	else
		atomic_store(&trigger->armed, true);
	return err;
}

static int64_t host_ns(const struct usb_stream *stream, const struct usb_shot *shot)
{
	return shot->device_ns + atomic_load(&stream->delay_ns);
}

/* What follows the shot's first sample was taken, so that one was not late. */
static bool is_known(const struct usb_stream *stream, const struct usb_shot *shot)
{
	return atomic_load(&stream->taken_sample) >= shot->sample;
}

/* What a later stream knows of its beginning does not hold for an earlier one. */
static int64_t uncertainty_ns(const struct usb_stream *stream, const struct usb_shot *shot)
{
	int64_t now_ns = atomic_load(&stream->uncertainty_ns);
	bool earlier = shot->sample < atomic_load(&stream->first_sample);

	return earlier && shot->uncertainty_ns > now_ns ? shot->uncertainty_ns : now_ns;
}

static struct edge tell(struct usb_trigger *trigger, const struct usb_shot *shot)
{
	const struct usb_stream *stream = &trigger->stream;
	uint64_t expected = trigger->any ? trigger->last_shot + 1 : 0;
	int64_t begin_ns = host_ns(stream, shot), now_ns = clock_now_ns();

	trigger->any = true;
	trigger->last_shot = shot->shot;
	return (struct edge){.shot = shot->shot,
			     .edge_ns = begin_ns + stream->wave.edge_off_ns,
			     .uncertainty_ns = uncertainty_ns(stream, shot) +
					       (now_ns - begin_ns) / DRIFT_SHARE,
			     .late_ns = begin_ns > shot->due_ns ? begin_ns - shot->due_ns : 0,
			     .missed = (uint32_t)(shot->shot - expected),
			     .events = shot->events};
}

static int usb_next(struct trigger *base, int64_t timeout_ns, struct edge *out)
{
	struct usb_trigger *trigger = (struct usb_trigger *)base;
	struct usb_stream *stream = &trigger->stream;
	int64_t now_ns = clock_now_ns(), give_up_ns = now_ns + timeout_ns;
	int64_t over_ns = usb_wave_ns(stream->wave.divisor, stream->wave.over);

	if (!atomic_load(&trigger->armed))
		return -ENODEV;
	for (;; now_ns = clock_now_ns()) {
		const struct usb_shot *shot = ring_peek(&stream->shots, 0);
		int64_t wake_ns = shot ? host_ns(stream, shot) + over_ns : give_up_ns;

		if (atomic_load(&stream->lost))
			return atomic_load(&stream->lost);
		if (shot && wake_ns <= now_ns && is_known(stream, shot)) {
			*out = tell(trigger, shot);
			ring_pop(&stream->shots);
			return 0;
		}
		if (now_ns >= give_up_ns)
			return -ETIMEDOUT;
		if (wake_ns <= now_ns || wake_ns > give_up_ns)
			wake_ns = give_up_ns;
		clock_semaphore_wait(&trigger->wake, wake_ns);
	}
}

const struct trigger_driver usb_trigger_driver = {
	.name = "usb",
	.reports_edges = true,
	.list = usb_list,
	.check = usb_check,
	.fires = usb_address_fires,
	.open = usb_open,
	.close = usb_close,
	.arm = usb_arm,
	.disarm = usb_disarm,
	.next = usb_next,
};
