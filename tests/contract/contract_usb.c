/*
 * The usb: trigger keeps the contract:
 *
 *     contract_usb SERIAL,strobe=LINE,... [FILE...]
 *
 * on an adapter of this machine; each FILE reads 0 while one of its lines is dark. Without an
 * address it says that it skips.
 */
#include <stdio.h>

#include "base/clock.h"
#include "drivers/usb/trigger_usb.h"
#include "tests/contract/trigger_contract.h"

int main(int argc, char **argv)
{
	static const struct trigger_plan plan = {.period_ns = 100 * NS_PER_MS,
						 .ir_exposure_ns = 45 * NS_PER_MS,
						 .strobe_delay_ns = 4 * NS_PER_MS,
						 .strobe_width_ns = 8 * NS_PER_MS,
						 .strobe_duty_max = 0.5,
						 .hd_divider = 4,
						 .hd_phase = 1,
						 .hd_exposure_ns = 40 * NS_PER_MS};

	if (argc < 2) {
		puts("1..0 # SKIP no adapter named; ./stage hil has one");
		return 0;
	}
	const struct trigger_contract contract = {
		.driver = &usb_trigger_driver,
		.rest = argv[1],
		.bad_rest = "no-such-adapter",
		.dark = (const char *const *)argv + 2,
		.plan = &plan,
	};

	return trigger_contract_run(&contract);
}
