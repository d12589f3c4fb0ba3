/*
 * A short packet is the means: a transfer whose length is no multiple of the packet ends in one,
 * and what follows begins a packet wherever it is wanted. So nothing is shifted, and every edge is
 * where the plan has it, to the nearest sample.
 */
#include "drivers/usb/usb_wave.h"

#include <errno.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/trigger_plan.h"

#define HD_PULSE_MIN_NS (50 * NS_PER_US) /* cameras take that for a trigger; longer is nicer */
#define SLACK_SHARE 2500                 /* of a period: quartzes are better than that */
#define SLACK_MIN 2
#define DIVISOR_USUAL 60 /* 1 us: finer than any camera needs */
#define ROUNDING 3       /* samples: of two roundings, and the last one of a packet, which is low */

static int64_t least(int64_t a, int64_t b)
{
	return a < b ? a : b;
}

static int64_t most(int64_t a, int64_t b)
{
	return a > b ? a : b;
}

static double us(int64_t time_ns)
{
	return (double)time_ns / NS_PER_US;
}

int64_t usb_wave_ns(uint32_t divisor, int64_t samples)
{
	return samples * divisor * 50 / 3; /* 10^9 / USB_WAVE_CLOCK_HZ */
}

static int64_t whole_samples(uint32_t divisor, int64_t time_ns)
{
	return time_ns * 3 / (50 * (int64_t)divisor);
}

int64_t usb_wave_samples(uint32_t divisor, int64_t time_ns)
{
	int64_t sample = 50 * (int64_t)divisor;

	return (time_ns * 3 + (time_ns < 0 ? -sample : sample) / 2) / sample;
}

/* The HD pulse shares the shot's first packet when it begins before the light is over. */
static bool hd_is_early(const struct trigger_plan *plan)
{
	return plan->hd_delay_ns <= plan->ir_delay_ns + plan->ir_exposure_ns + 2 * HD_PULSE_MIN_NS;
}

/* What must fit into a packet, from the shot's edge on. */
static int64_t span_ns(const struct trigger_plan *plan, bool has_hd)
{
	int64_t end_ns = most(plan->ir_delay_ns + plan->ir_exposure_ns,
			      plan->strobe_delay_ns + plan->strobe_width_ns);

	if (has_hd && hd_is_early(plan))
		end_ns = most(end_ns,
			      plan->hd_delay_ns + least(plan->hd_exposure_ns, HD_PULSE_MIN_NS));
	return end_ns;
}

/* Samples of so many nanoseconds are `samples` or fewer. */
static uint32_t divisor_for(int64_t time_ns, int64_t samples)
{
	int64_t sample = 50 * samples;

	return (uint32_t)((time_ns * 3 + sample - 1) / sample);
}

static int choose_clock(struct usb_wave *wave, const struct trigger_plan *plan, const char *who,
			struct diag *diag)
{
	int64_t end_ns = span_ns(plan, wave->bits[PULSE_HD] != 0);
	int64_t room = (int64_t)wave->packet - ROUNDING;
	uint32_t needed = divisor_for(end_ns, room);
	uint32_t coarsest =
		(uint32_t)least(USB_WAVE_DIVISOR_MAX,
				plan->period_ns * 3 / (50 * (USB_WAVE_PERIOD_MIN + ROUNDING)));

	if (needed > coarsest || coarsest < USB_WAVE_DIVISOR_MIN) {
		diag_add(
			diag,
			"%s: the plan's exposure: its pulses end %.6g us after the edge, and a USB "
			"packet holds %.6g us at this rate; shorten exposure and delays, or lower "
			"the rate",
			who, us(end_ns), us(usb_wave_ns(coarsest, room)));
		return -EINVAL;
	}
	wave->divisor = (uint32_t)most(needed, divisor_for(plan->period_ns, USB_WAVE_PERIOD_MAX));
	wave->divisor = (uint32_t)most(wave->divisor, least(DIVISOR_USUAL, coarsest));
	wave->period = (uint32_t)usb_wave_samples(wave->divisor, plan->period_ns);
	wave->slack = (uint32_t)most(SLACK_MIN, wave->period / SLACK_SHARE);
	return 0;
}

/* Never longer than planned: a strobe is bound by its share of the time. */
static struct usb_pulse place(const struct usb_wave *wave, int64_t delay_ns, int64_t length_ns)
{
	uint32_t begin = (uint32_t)usb_wave_samples(wave->divisor, delay_ns);

	return (struct usb_pulse){begin, begin + (uint32_t)whole_samples(wave->divisor, length_ns)};
}

static int place_light(struct usb_wave *wave, const struct trigger_plan *plan, const char *who,
		       struct diag *diag)
{
	struct usb_pulse *ir = &wave->pulses[PULSE_IR], *strobe = &wave->pulses[PULSE_STROBE];

	*ir = place(wave, plan->ir_delay_ns, plan->ir_exposure_ns);
	if (ir->end == ir->begin)
		ir->end++;
	if (wave->bits[PULSE_STROBE] && plan->strobe_width_ns > 0) {
		*strobe = place(wave, plan->strobe_delay_ns, plan->strobe_width_ns);
		if (strobe->end == strobe->begin) {
			diag_add(diag,
				 "%s: the plan's strobe_width: %.6g us is less than a sample of "
				 "%.6g "
				 "us; lengthen it, or shorten exposure and delays",
				 who, us(plan->strobe_width_ns), us(usb_wave_ns(wave->divisor, 1)));
			return -EINVAL;
		}
	}
	wave->lit_end = (uint32_t)most(ir->end, strobe->end);
	wave->over = strobe->end ? strobe->end : ir->begin + 1;
	return 0;
}

static int place_hd(struct usb_wave *wave, const struct trigger_plan *plan, const char *who,
		    struct diag *diag)
{
	struct usb_pulse *hd = &wave->pulses[PULSE_HD];
	int64_t length_ns = least(plan->hd_exposure_ns, usb_wave_ns(wave->divisor, wave->packet));

	if (!wave->bits[PULSE_HD] || plan->hd_exposure_ns <= 0)
		return 0;
	if (plan->hd_delay_ns > plan->period_ns - 2 * HD_PULSE_MIN_NS) {
		diag_add(diag,
			 "%s: the plan's hd.delay: %.6g us after the edge is not within the shot's "
			 "period of %.6g us; shorten it, or choose a later hd.phase",
			 who, us(plan->hd_delay_ns), us(plan->period_ns));
		return -EINVAL;
	}
	*hd = place(wave, plan->hd_delay_ns, length_ns);
	if (hd->end == hd->begin)
		hd->end++;
	if (hd->begin > wave->lit_end)
		wave->hd_cut = hd->begin;
	if (hd->end >= wave->hd_cut + wave->packet)
		hd->end = wave->hd_cut + wave->packet - 1;
	return 0;
}

/* As pulse_train_report.c has it: where the middle of the light really is. */
static int64_t edge_off_ns(const struct usb_wave *wave, const struct trigger_plan *plan)
{
	const struct usb_pulse *strobe = &wave->pulses[PULSE_STROBE];
	int64_t open_ns = usb_wave_ns(wave->divisor, wave->pulses[PULSE_IR].begin);
	int64_t begin_ns = most(open_ns, usb_wave_ns(wave->divisor, strobe->begin));
	int64_t end_ns =
		least(open_ns + plan->ir_exposure_ns, usb_wave_ns(wave->divisor, strobe->end));

	if (!strobe->end || end_ns <= begin_ns)
		return open_ns - plan->ir_delay_ns;
	return begin_ns + (end_ns - begin_ns) / 2 - trigger_plan_ir_middle_ns(plan);
}

int usb_wave_make(struct usb_wave *out, const struct trigger_plan *plan,
		  const uint8_t bits[PULSE_LINE_COUNT], uint32_t packet, const char *who,
		  struct diag *diag)
{
	struct usb_wave wave = {
		.packet = packet, .hd_divider = plan->hd_divider, .hd_phase = plan->hd_phase};

	memcpy(wave.bits, bits, sizeof(wave.bits));
	int err = choose_clock(&wave, plan, who, diag);

	if (!err)
		err = place_light(&wave, plan, who, diag);
	if (!err)
		err = place_hd(&wave, plan, who, diag);
	if (err)
		return err;
	wave.edge_off_ns = edge_off_ns(&wave, plan);
	*out = wave;
	return 0;
}

static bool has_hd(const struct usb_wave *wave, uint64_t shot)
{
	return wave->pulses[PULSE_HD].end &&
	       shot % (uint64_t)wave->hd_divider == (uint64_t)wave->hd_phase;
}

void usb_wave_fill(const struct usb_wave *wave, uint64_t shot, uint8_t *samples, uint32_t length)
{
	memset(samples, 0, length);
	for (int l = 0; l < PULSE_LINE_COUNT; l++) {
		const struct usb_pulse *pulse = &wave->pulses[l];
		/* the shot's last sample is low as well */
		uint32_t end = (uint32_t)least(pulse->end, length - 1);

		if (l == PULSE_HD && !has_hd(wave, shot))
			continue;
		for (uint32_t s = pulse->begin; s < end; s++)
			samples[s] |= wave->bits[l];
	}
}

/* Whole packets first, what is left over by itself: the end of the first tells how far the adapter
 * is, whatever it makes of short packets. */
static uint32_t cut_piece(const struct usb_wave *wave, uint32_t length, uint32_t *cuts)
{
	uint32_t rest = length % wave->packet, count = 0;

	if (length > rest)
		cuts[count++] = length - rest;
	if (rest)
		cuts[count++] = rest;
	return count;
}

uint32_t usb_wave_cut(const struct usb_wave *wave, uint64_t shot, uint32_t length,
		      uint32_t cuts[USB_WAVE_CUTS_MAX])
{
	uint32_t head = has_hd(wave, shot) ? wave->hd_cut : 0;
	uint32_t count = cut_piece(wave, head, cuts);

	return count + cut_piece(wave, length - head, cuts + count);
}
