/*
 * Emulated adapters (bit_bang.c) on buses of their own, and the usb trigger on them: for tests.
 * Failing is cmocka's. Adapters do not outlive the test.
 */
#pragma once

#include "base/clock.h"
#include "drivers/trigger.h"

#define USB_RIG_PATIENCE_NS (10 * NS_PER_S) /* for the kernel, to see what is plugged in or out */
#define USB_RIG_TRACE "/tmp/bit_bang.trace" /* of adapter 0: what it had on its lines */

extern const struct trigger_driver *const usb_rig_driver;
extern const struct trigger_plan usb_rig_plan; /* 5 shots a second */

/* Of a test's main(): where the programs are. Returns 0 or -EINVAL, told. */
int usb_rig_find_programs(int argc, char **argv);

/* Around each test: adapter 0 with the serial number EMU0 is plugged in; all are unplugged. */
int usb_rig_begin(void **state);
int usb_rig_end(void **state);

void usb_rig_plug_in(int index, const char *serial, const char *product);
void usb_rig_unplug(int index);

/* Opens what will soon be there; the caller closes it. */
struct trigger *usb_rig_await(const char *rest);
void usb_rig_arm(struct trigger *trigger);
struct edge usb_rig_next_edge(struct trigger *trigger);

void usb_rig_wait_ms(int64_t time_ms);
