/*
 * From a plan to samples: which line of a USB adapter is high in which sample of a shot, and into
 * which transfers its samples are divided so that every packet on the wire ends with all lines low.
 * Pulses never straddle packets: a shot begins a packet, and so does an HD pulse behind its light.
 * Pure.
 */
#pragma once

#include "drivers/gpio/pulse_train.h"

#define USB_WAVE_CLOCK_HZ INT64_C(60000000) /* samples a second, times the divisor */
#define USB_WAVE_DIVISOR_MIN 15             /* 4 Mbyte/s */
#define USB_WAVE_DIVISOR_MAX 16383          /* 14 bits */
#define USB_WAVE_FIFO_SAMPLES 1024          /* the adapter holds so many */
#define USB_WAVE_PERIOD_MIN USB_WAVE_FIFO_SAMPLES
#define USB_WAVE_PERIOD_MAX 65536
#define USB_WAVE_CUTS_MAX 4

/* Where a line is high: samples of a shot, from begin to before end. */
struct usb_pulse {
	uint32_t begin, end;
};

struct usb_wave {
	uint32_t divisor;
	uint32_t packet;  /* samples that the largest packet holds */
	uint32_t period;  /* samples of a shot, the nearest number */
	uint32_t slack;   /* that a shot may be longer or shorter, to keep to the time */
	uint32_t lit_end; /* IR lines and strobes are low from this sample on */
	uint32_t over;    /* the sample in which a shot has had its light */
	uint32_t hd_cut;  /* where the HD pulse begins a packet; 0: it is in the shot's first */
	int hd_divider, hd_phase;
	struct usb_pulse pulses[PULSE_LINE_COUNT]; /* none when empty */
	uint8_t bits[PULSE_LINE_COUNT];            /* of the lines that are wired, or 0 */
	int64_t edge_off_ns; /* from sample 0 to the edge that the light's middle counts from */
};

/* Samples and nanoseconds of the adapter's own clock. */
int64_t usb_wave_ns(uint32_t divisor, int64_t samples);
int64_t usb_wave_samples(uint32_t divisor, int64_t time_ns); /* the nearest */

/* The finest clock at which all of `plan` fits. `plan` was checked; `bits` are the lines'; `packet`
 * samples fit into a packet. Returns 0 or -EINVAL with a message that begins with `who`. */
int usb_wave_make(struct usb_wave *out, const struct trigger_plan *plan,
		  const uint8_t bits[PULSE_LINE_COUNT], uint32_t packet, const char *who,
		  struct diag *diag);

/* The `length` samples of shot `shot`: its period, at most slack more or less. */
void usb_wave_fill(const struct usb_wave *wave, uint64_t shot, uint8_t *samples, uint32_t length);

/* The lengths of the transfers that make up a shot; their sum is `length`. Returns how many. Only
 * the last packet of a transfer may be short. */
uint32_t usb_wave_cut(const struct usb_wave *wave, uint64_t shot, uint32_t length,
		      uint32_t cuts[USB_WAVE_CUTS_MAX]);
